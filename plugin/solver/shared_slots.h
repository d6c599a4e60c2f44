// What several blocks of a stage move, by mass splitting.
//
// Tonge, Benevolenski and Voroshilov 2012, "Mass splitting for jitter-free parallel rigid body
// simulation": what s blocks move at the same time is split into s parts, each s times as light.
// Each block moves a part of its own. Afterwards the parts are joined again, at the mean of where
// they are. This conserves momentum, and the sweeps converge to the same solution.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lazyccd/span.h"
#include "solver/row_block.h"

namespace lazyccd::bullet {

/// The slots of which blocks of one stage have copies. A slot is the index of a displacement: that
/// of a node, or the translation or the rotation of a rigid body.
class SharedSlots {
 public:
  /// Some slots of one island.
  struct Grain {
    std::size_t island, first, last;  ///< last: one past the last
  };

  /// Collects the shared slots of some blocks, in the order of the blocks. `scratch`: by slot,
  /// zeros; left so.
  void build(Span<const RowBlock> blocks, std::vector<std::int32_t>& scratch);

  const std::vector<Grain>& grains() const { return grains_; }
  std::int32_t slot(std::size_t i) const { return slots_[i]; }
  /// The copies of a slot as indices of displacements, in the order of the blocks.
  Span<const std::int32_t> copies(std::size_t i) const {
    return {copies_.data() + first_[i], first_[i + 1] - first_[i]};
  }

 private:
  std::vector<Grain> grains_;
  std::vector<std::int32_t> slots_, copies_;
  std::vector<std::size_t> first_;  // by slot: of its copies; then their number
};

}  // namespace lazyccd::bullet
