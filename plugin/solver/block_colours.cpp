#include "solver/block_colours.h"

#include <algorithm>

namespace lazyccd::bullet {
namespace {

// The colours above the overflow bit do not exist; that of the overflow itself is never full.
constexpr std::uint64_t overflow_bit = std::uint64_t{1} << BlockColours::overflow;

int lowest_zero(std::uint64_t bits) {
  int i = 0;
  while (bits >> i & 1) ++i;
  return i;
}

}  // namespace

void BlockColours::begin() {
  used_.clear();
  bodies_.clear();
}

int BlockColours::add_body(int limit) {
  bodies_.push_back({std::max(1, limit), 0, {}});
  return static_cast<int>(bodies_.size()) - 1;
}

int BlockColours::add_block(const std::vector<std::int32_t>& slots,
                            const std::vector<int>& bodies) {
  std::uint64_t taken = 0;
  for (const std::int32_t slot : slots) taken |= used_[static_cast<std::size_t>(slot)];
  for (const int body : bodies) taken |= bodies_[static_cast<std::size_t>(body)].full;
  const int colour = lowest_zero(taken & ~overflow_bit);
  const std::uint64_t bit = std::uint64_t{1} << colour;
  for (const std::int32_t slot : slots) used_[static_cast<std::size_t>(slot)] |= bit;
  for (const int i : bodies) {
    Body& body = bodies_[static_cast<std::size_t>(i)];
    if (++body.blocks[colour] >= body.limit) body.full |= bit;
  }
  return colour;
}

int BlockColours::close_body(int i) {
  Body& body = bodies_[static_cast<std::size_t>(i)];
  // Blocks of the overflow are solved one after the other.
  const int most = *std::max_element(body.blocks, body.blocks + overflow);
  body.limit = std::max(1, most);
  body.full = 0;
  for (int colour = 0; colour < overflow; ++colour)
    if (body.blocks[colour] >= body.limit) body.full |= std::uint64_t{1} << colour;
  return body.limit;
}

}  // namespace lazyccd::bullet
