// What the sources of the contact solver share.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "settings.h"
#include "solver/contact_solver.h"
#include "util/box.h"
#include "util/matrix.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Index of the displacement that is the translation of a rigid body; its rotation follows.
constexpr std::int32_t translation_slot(std::int32_t body) { return 1 + 2 * body; }
/// The rigid body whose translation or rotation a displacement is.
constexpr std::int32_t body_of_slot(std::int32_t slot) { return (slot - 1) / 2; }

/// Sets the first three of four floats.
inline void set(float* to, const Vector3d& x) {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(x[k]);
}

/// Displacement of one side relative to the other in the step, without the impulses of the problem,
/// and for those on the motion without links that were solved again, metres.
Vector3d move_without_impulses(const ContactRow& row, bool for_split_impulse, const Motion& motion);

/// Adds rows to the problem, in new blocks. run() and next() are those of Threads::run_phases(), so
/// that it can be a part of other phases.
class ContactSolver::NewBlocks {
 public:
  explicit NewBlocks(ContactSolver& solver)
      : s_(solver),
        rows_(solver.new_rows_.rows),
        parts_(solver.new_rows_.parts),
        boxes_(solver.places_),
        keys_(solver.keys_) {}

  /// Begins with new_rows_, and may order them. Returns the number of items of the first phase; 0
  /// if there are no rows.
  std::size_t start();
  void run(std::size_t item, int worker);
  /// Returns the number of items of the next phase; 0 at the end.
  std::size_t next();
  /// The first of the new blocks.
  std::size_t first() const { return first_; }

 private:
  enum class Phase { measure, find_places, claim, collect, number, find_slots, find_shared, fill };

  using Box = Box3d;

  // Rows of a part that a thread takes at a time when it looks where they are.
  struct Piece {
    std::size_t part, first, last;
  };

  // Rows of a block of the part, but for the last block.
  static std::size_t block_size(const RowsByIsland::Part& part) {
    const std::size_t count = part.last - part.first;
    const std::size_t blocks = std::clamp<std::size_t>(count / settings::solver::min_block_rows, 1,
                                                       settings::solver::max_blocks);
    return (count + blocks - 1) / blocks;
  }
  // Whether the rows of the part make several blocks, and so are ordered by their places.
  static bool needs_order(const RowsByIsland::Part& part) {
    return part.last - part.first > block_size(part);
  }

  std::size_t begin(Phase phase) {
    phase_ = phase;
    return s_.block_count_ - first_;
  }
  std::size_t begin_blocks();
  /// The body that a row should not be separated over: one that splitting its mass would slow down
  /// (-1: none), or any multibody (multibodies), which only one block may move.
  int bond(std::int32_t row) const;
  /// Upper bound of a rigid body's part of a row's compliance, as a fraction.
  double share(const RigidTerm& term, double normal_mass) const;
  double normal_mass(std::int32_t row) const;
  /// Makes the keys of the rows of an item.
  void find_places(std::size_t item);
  /// Where a row is: at its first vertex, at the start of the step.
  Vector3d place_of(std::int32_t row) const;
  /// Finds the bounds of the rows of an item.
  void measure(std::size_t item);
  /// Takes the rows of the block, finds its rigid bodies, and claims its vertices that have no
  /// displacement yet. The first block that moves a vertex gets it.
  void claim(std::size_t item);
  void find_bodies(RowBlock& block, std::int32_t row) const;
  /// Collects the vertices that the block has got.
  void collect(std::size_t item);
  void number_vertices();
  /// Sets displacements of the vertices that the block has got.
  void number(const RowBlock& block);
  /// Collects what the block moves, when all vertices have their displacements.
  void find_slots(RowBlock& block, Indices& seen);
  /// Finds what other blocks move too.
  void find_shared(RowBlock& block) const;
  void make_copies();
  void split_coupling(RowBody& body, float split);

  ContactSolver& s_;
  Phase phase_ = Phase::measure;
  std::size_t first_ = 0;
  Indices& rows_;
  const std::vector<RowsByIsland::Part>& parts_;
  ScratchVector<Piece> pieces_;
  std::vector<Box>& boxes_;           // by piece
  ScratchVector<Box> part_boxes_;     // by part
  std::vector<std::uint64_t>& keys_;  // of the rows: place in space, and row
};

// With fewer items, or rows in the list or in blocks, a second thread costs more than it saves.
inline constexpr std::size_t min_parallel_items = 8, min_parallel_rows = 2048;

inline const Threads& ContactSolver::threads_for(std::size_t items) const {
  return items < min_parallel_items || needs_.size() < min_parallel_rows ? serial_ : threads_;
}

template <class Each>
void ContactSolver::for_each(std::size_t count, const Each& each) const {
  threads_for(count).run_phases(count, each, [] { return std::size_t{0}; });
}

template <class Each, class Join>
void ContactSolver::for_each_block_by_stage(const Each& each, const Join& join) {
  std::size_t stage = 0;
  bool joins = false;
  const auto next = [&]() -> std::size_t {
    const std::size_t grains = stages_[stage].shared.grains().size();
    joins = !joins && grains > 0;
    if (joins) return grains;
    return ++stage == stage_count_ ? 0 : stages_[stage].last - stages_[stage].first;
  };
  const auto run = [&](std::size_t item, int worker) {
    const Stage& now = stages_[stage];
    if (joins) return join(now.shared, now.shared.grains()[item]);
    each(blocks_[now.first + item], worker);
  };
  if (stage_count_ > 0)
    threads_of_blocks().run_phases(stages_[0].last - stages_[0].first, run, next);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
