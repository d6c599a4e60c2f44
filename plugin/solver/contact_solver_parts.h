// What the sources of the contact solver share.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>

#include "solver/contact_solver.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Index of the displacement that is the translation of a rigid body; its rotation follows.
constexpr std::int32_t translation_slot(std::int32_t body) { return 1 + 2 * body; }

/// Sets the first three of four floats.
inline void set(float* to, const Eigen::Vector3d& x) {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(x[k]);
}

/// Displacement of one side relative to the other in the step, without the impulses of the problem,
/// metres.
Eigen::Vector3d move_without_impulses(const ContactRow& row, bool for_split_impulse,
                                      const Motion& motion);

/// Adds rows to the problem, in new blocks. run() and next() are those of Threads::run_phases(), so
/// that it can be a part of other phases.
class ContactSolver::NewBlocks {
 public:
  explicit NewBlocks(ContactSolver& solver)
      : s_(solver), boxes_(solver.places_), keys_(solver.keys_) {}

  /// Takes the rows. Returns the number of items of the first phase; 0 if there are no rows.
  std::size_t start(RowsByIsland rows);
  void run(std::size_t item, int worker);
  /// Returns the number of items of the next phase; 0 at the end.
  std::size_t next();
  /// The first of the new blocks.
  std::size_t first() const { return first_; }

 private:
  enum class Phase { measure, find_places, claim, collect, number, find_slots, fill };

  using Box = Eigen::AlignedBox3d;

  // Rows of a part that a thread takes at a time when it looks where they are.
  struct Piece {
    std::size_t part, first, last;
  };

  // Whether the rows of the part make several blocks, and so are ordered by their places.
  static bool needs_order(const RowsByIsland::Part& part) {
    return part.last - part.first > RowBlock::max_rows;
  }

  std::size_t begin(Phase phase) {
    phase_ = phase;
    return s_.block_count_ - first_;
  }
  std::size_t begin_blocks();
  /// Makes the keys of the rows of an item.
  void find_places(std::size_t item);
  /// Where a row is: at its first vertex, at the start of the step.
  Eigen::Vector3d place_of(std::int32_t row) const;
  /// Finds the bounds of the rows of an item.
  void measure(std::size_t item);
  /// Takes the rows of the block, finds its rigid bodies, and claims its vertices that have no
  /// displacement yet. The first block that moves a vertex gets it.
  void claim(std::size_t item);
  void find_bodies(RowBlock& block, std::int32_t row);
  /// Collects the vertices that the block has got.
  void collect(std::size_t item);
  void number_vertices();
  /// Collects what the block moves, when all vertices have their displacements.
  void find_slots(RowBlock& block);
  void share_bodies();
  void colour();

  ContactSolver& s_;
  Phase phase_ = Phase::measure;
  std::size_t first_ = 0;
  Indices rows_;
  std::vector<RowsByIsland::Part> parts_;
  std::vector<Piece> pieces_;
  std::vector<Box>& boxes_;           // by piece
  std::vector<Box> part_boxes_;       // by part
  std::vector<std::uint64_t>& keys_;  // of the rows: place in space, and row
};

// With fewer chunks or blocks a second thread costs more than it saves.
inline constexpr std::size_t min_parallel_items = 8;

template <class Each>
void ContactSolver::for_each(std::size_t count, const Each& each) const {
  const Threads& threads = count < min_parallel_items ? serial_ : threads_;
  threads.run_phases(count, each, [] { return std::size_t{0}; });
}

template <class Each, class AfterColour>
void ContactSolver::for_each_block_by_colour(const Each& each, const AfterColour& after_colour) {
  int colour = -1;
  const auto next = [&]() -> std::size_t {
    if (colour >= 0 && colour != BlockColours::overflow) after_colour(blocks_of_colour_[colour]);
    do {
      if (++colour == BlockColours::count) return 0;
    } while (blocks_of_colour_[colour].empty());
    return colour == BlockColours::overflow ? 1 : blocks_of_colour_[colour].size();
  };
  const auto run = [&](std::size_t item, int worker) {
    if (colour != BlockColours::overflow)
      return each(blocks_[blocks_of_colour_[colour][item]], worker);
    for (const std::int32_t block : blocks_of_colour_[colour]) {
      each(blocks_[block], worker);
      after_colour({block});
    }
  };
  const Threads& threads = block_count_ < 2 * min_parallel_items ? serial_ : threads_;
  threads.run_phases(next(), run, next);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
