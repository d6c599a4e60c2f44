// Batches of rows that can be solved at the same time. No two rows of a batch move the same node or
// rigid body, so solving them together equals solving them one after the other.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "response/pgs_kernels.h"

namespace lazyccd::bullet {

/// Distributes rows over batches greedily. A slot is the index of a displacement: that of a node,
/// or one that stands for a rigid body.
class RowBatches {
 public:
  /// Row indices of one batch; `none` fills up a batch that is not full.
  using Batch = std::array<std::int32_t, RowBatch::lanes>;
  static constexpr std::int32_t none = -1;
  static constexpr int max_slots = 8;  // most slots that one row moves

  /// Starts over, for rows that move slots with indices below `slots`.
  void begin(std::size_t slots);
  /// Adds a row to the first open batch that moves none of its slots. [first_slot, last_slot) are
  /// the slots that the row moves, at most max_slots.
  void add(std::int32_t row, const std::int32_t* first_slot, const std::int32_t* last_slot);
  /// Closes all open batches.
  void finish();
  /// Closed batches, in the order in which they were closed: when they became full, or were the
  /// oldest when room was needed, or at finish().
  const std::vector<Batch>& batches() const { return batches_; }

 private:
  /// Number of batches that are filled at the same time. The more, the fewer are closed before they
  /// are full. At most the number of bits in an element of open_batches_with_.
  static constexpr int max_open_batches = 8;
  struct OpenBatch {
    Batch rows;
    int count = 0, slot_count = 0;
    std::array<std::int32_t, RowBatch::lanes * max_slots> slots;
  };

  void close(int i);

  std::vector<std::uint8_t>
      open_batches_with_;  // by slot: bit mask of the open batches that move it
  std::array<OpenBatch, max_open_batches> open_batches_;
  int oldest_ = 0;  // open batch to close next if none fits
  std::vector<Batch> batches_;
};

}  // namespace lazyccd::bullet
