// Colours of blocks of rows: blocks of one colour move nothing in common, so they can be solved at
// the same time, in any order, with the same result.
//
// The colouring is greedy, in the order of the blocks, and is kept when blocks are added. Box2D
// (constraint_graph.c) and Jolt (LargeIslandSplitter.cpp) colour single constraints in this way.
#pragma once

#include <cstdint>
#include <vector>

namespace lazyccd::bullet {

/// Colours of blocks. A slot is the index of something that one block of a colour may move. A
/// shared body may be moved by several blocks of a colour, up to its limit.
class BlockColours {
 public:
  static constexpr int count = 64;
  /// The last colour is for blocks that fit no other one. They may move the same things, so they
  /// must be solved one after the other.
  static constexpr int overflow = count - 1;

  /// Starts over without blocks and shared bodies.
  void begin();
  /// Makes room for slots with indices below `slots`.
  void grow(std::size_t slots) { used_.resize(slots, 0); }
  /// Adds a shared body, of which a colour may have `limit` blocks, at least 1. Returns its index.
  int add_body(int limit);
  /// Colours a block that moves these slots and shared bodies. Repeated slots are allowed.
  int add_block(const std::vector<std::int32_t>& slots, const std::vector<int>& bodies);
  /// Lowers the limit of a body to the largest number of its blocks that a colour has; returns it.
  int close_body(int body);

 private:
  struct Body {
    int limit;
    std::uint64_t full;  // colours that have `limit` blocks
    std::uint16_t blocks[count];
  };

  std::vector<std::uint64_t> used_;  // by slot: colours that have a block that moves it
  std::vector<Body> bodies_;
};

}  // namespace lazyccd::bullet
