// Blocks of rows: what one thread solves at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "solver/pgs_kernels.h"
#include "solver/row_batches.h"

namespace lazyccd::bullet {

/// Some hundred rows that lie near each other, in batches, and all that a sweep over them writes,
/// but for the displacements that it alone moves. Kept for its memory.
struct RowBlock {
  using Indices = std::vector<std::int32_t>;

  std::size_t island = 0;  ///< of its rows, see RowIslands
  Indices rows;            ///< of the list
  Indices new_rows;        ///< of them: to be made when the block is filled
  Indices vertices;        ///< soft vertices that its rows move, row by row
  Indices bodies;          ///< rigid bodies that its rows move, without links of multibodies
  Indices new_vertices;    ///< of `vertices`: those that no block before it moves, once
  std::int32_t first_new_slot = 0;  ///< displacement of the first of them
  Indices slots;                    ///< displacements that its rows move, once, without multibodies
  Indices shared;                   ///< of them: those that other blocks of its stage move too
  /// First of its own displacements: RowBatch::vertices dummies, then its copies of `shared`.
  std::int32_t first_own = 0;

  std::vector<RowBatches::Batch> batch_rows;  ///< by batch: its rows
  std::vector<RowBatch> batches;
  std::vector<RowRigidTerm> terms;
  Indices active;               ///< batches that carry an impulse, or did one sweep before
  bool has_new_active = false;  ///< one of them was not active when they were looked for before

  SweepChange change;   ///< of the last sweep
  float violation = 0;  ///< largest one found by max_violation()

  /// Its copy of shared[i].
  std::int32_t copy(std::size_t i) const {
    return first_own + RowBatch::vertices + static_cast<std::int32_t>(i);
  }
  std::size_t own_count() const { return RowBatch::vertices + shared.size(); }
};

}  // namespace lazyccd::bullet
