// Rows in groups that can be solved at once: no two of one move the same thing, so that one after
// the other comes to the same.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "response/pgs_kernels.h"

namespace lazyccd::bullet {

class RowBatches {
 public:
  // Rows; `none` in place of those that are missing at the end.
  using Group = std::array<std::int32_t, RowBatch::rows>;
  static constexpr std::int32_t none = -1;
  static constexpr int most_things = 8;  // that a row moves

  // Of rows that move some of so many things.
  void begin(std::size_t things);
  // Adds a row to the first open group that moves none of what it moves.
  void add(std::int32_t row, const std::int32_t* first_thing, const std::int32_t* last_thing);
  // Ends all groups. They are in the order in which they became full.
  void finish();
  const std::vector<Group>& groups() const { return groups_; }

 private:
  // The more, the fewer end before they are full; no more than there are bits below.
  static constexpr int open_count = 8;
  struct Open {
    Group rows;
    int count = 0, thing_count = 0;
    std::array<std::int32_t, RowBatch::rows * most_things> things;
  };

  void end(int open);

  std::vector<std::uint8_t> open_with_;  // by thing: bits of the open groups that move it
  std::array<Open, open_count> open_;
  int oldest_ = 0;
  std::vector<Group> groups_;
};

}  // namespace lazyccd::bullet
