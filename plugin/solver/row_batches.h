// Batches of rows that can be solved at the same time: no two rows of a batch move the same slot.
// They may move the same rigid body or multibody, whose mass they split (contact_solver.h).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "settings.h"
#include "solver/pgs_kernels.h"

namespace lazyccd::bullet {

/// Distributes rows over batches greedily. A slot is the index of the displacement of a node.
///
/// Rows are put in layers first: rows of a layer share no slot. Batches are filled layer by layer,
/// so that most neighbouring batches share no slot either. A processor then works on several of
/// them at once, because none waits for what another stores.
class RowBatches {
 public:
  /// Row indices of one batch; `none` fills up a batch that is not full.
  using Batch = std::array<std::int32_t, RowBatch::lanes>;
  static constexpr std::int32_t none = -1;
  static constexpr int max_slots = 8;  // most slots that one row moves

  /// Starts over, for rows that move slots with indices below `slots`.
  void begin(std::size_t slots);
  /// Adds a row. [first_slot, last_slot) are the slots that it moves, at most max_slots.
  void add(std::int32_t row, const std::int32_t* first_slot, const std::int32_t* last_slot);
  /// Makes the batches of all rows. Call it before the next begin().
  void finish();
  const std::vector<Batch>& batches() const { return batches_; }

 private:
  static constexpr int max_open_batches = settings::solver::max_open_batches,
                       max_layers = settings::solver::max_layers;
  struct Row {
    std::int32_t row, slot_count, layer;
    std::array<std::int32_t, max_slots> slots;
  };
  struct OpenBatch {
    Batch rows;
    int count = 0, slot_count = 0;
    std::array<std::int32_t, RowBatch::lanes * max_slots> slots;
  };

  void pack(const Row& row);
  void close(int i);

  /// By slot, a bit mask: the layers that move it, and above them the open batches that do.
  std::vector<std::uint64_t> taken_;
  std::vector<Row> rows_;
  std::vector<const Row*> order_;  // scratch memory of finish()
  std::array<OpenBatch, max_open_batches> open_batches_;
  int oldest_ = 0;  // open batch to close next if none fits
  std::vector<Batch> batches_;
};

}  // namespace lazyccd::bullet
