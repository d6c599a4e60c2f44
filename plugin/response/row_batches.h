// Batches of rows that can be solved at the same time. No two rows of a group move the same node or
// rigid body, so solving them together equals solving them one after the other.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "response/pgs_kernels.h"

namespace lazyccd::bullet {

/// Distributes rows over groups greedily. A slot is the index of a displacement: that of a node, or
/// one that stands for a rigid body.
class RowBatches {
 public:
  /// Row indices of one group; `none` fills up a group that is not full.
  using Group = std::array<std::int32_t, RowBatch::rows>;
  static constexpr std::int32_t none = -1;
  static constexpr int max_slots = 8;  // most slots that one row moves

  /// Starts over, for rows that move slots with indices below `slots`.
  void begin(std::size_t slots);
  /// Adds a row to the first open group that moves none of its slots. [first_slot, last_slot) are
  /// the slots that the row moves, at most max_slots.
  void add(std::int32_t row, const std::int32_t* first_slot, const std::int32_t* last_slot);
  /// Closes all open groups.
  void finish();
  /// Closed groups, in the order in which they were closed: when they became full, or were the
  /// oldest when room was needed, or at finish().
  const std::vector<Group>& groups() const { return groups_; }

 private:
  /// Number of groups that are filled at the same time. The more, the fewer are closed before they
  /// are full. At most the number of bits in an element of open_groups_with_.
  static constexpr int max_open_groups = 8;
  struct OpenGroup {
    Group rows;
    int count = 0, slot_count = 0;
    std::array<std::int32_t, RowBatch::rows * max_slots> slots;
  };

  void close(int i);

  std::vector<std::uint8_t> open_groups_with_;  // by slot: bit mask of the open groups that move it
  std::array<OpenGroup, max_open_groups> open_groups_;
  int oldest_ = 0;  // open group to close next if none fits
  std::vector<Group> groups_;
};

}  // namespace lazyccd::bullet
