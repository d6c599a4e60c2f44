// Blocks of rows: what one thread solves at a time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "solver/pgs_kernels.h"
#include "solver/row_batches.h"

namespace lazyccd::bullet {

/// About a hundred rows that lie near each other, in batches, and all that a sweep over them
/// writes, but for the displacements of nodes. Kept for its memory.
struct RowBlock {
  static constexpr std::size_t max_rows = 128;

  using Indices = std::vector<std::int32_t>;

  std::size_t island = 0;           ///< of its rows, see RowIslands
  Indices rows;                     ///< of the list
  Indices new_rows;                 ///< of them: to be made when the block is filled
  Indices vertices;                 ///< soft vertices that its rows move, row by row
  Indices new_vertices;             ///< of them: those that no block before it moves, once
  std::int32_t first_new_slot = 0;  ///< displacement of the first of them
  Indices slots;               ///< displacements that this block alone may move within its colour
  std::vector<int> bodies;     ///< shared bodies that it moves, as indices in ContactSolver
  std::vector<double> shares;  ///< by shared body: its largest part of the compliance of a row
  int colour = 0;              ///< see BlockColours
  /// First of its own displacements: RowBatch::vertices dummies, then translation and rotation of
  /// its own copy of each of `bodies`.
  std::int32_t first_own = 0;

  std::vector<RowBatches::Batch> batch_rows;  ///< by batch: its rows
  std::vector<RowBatch> batches;
  std::vector<RowRigidTerm> terms;
  Indices active;               ///< batches that carry an impulse, or did one sweep before
  bool has_new_active = false;  ///< one of them was not active when they were looked for before

  /// By shared body: translation and rotation that the block's impulses make, metres and radians.
  std::vector<std::array<double, 6>> motion;
  SweepChange change;   ///< of the last sweep
  float violation = 0;  ///< largest one found by max_violation()

  std::int32_t copy_of(std::size_t body) const {
    return first_own + RowBatch::vertices + 2 * static_cast<std::int32_t>(body);
  }
};

}  // namespace lazyccd::bullet
