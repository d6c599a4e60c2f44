// Islands: groups of bodies that rows connect, directly or through others. What pushes one island
// moves nothing in another, so each is solved as if it were alone. Static and kinematic bodies
// connect nothing. Box2D and Bullet divide rigid bodies in the same way.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/row_list.h"
#include "lazyccd/span.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class RowIslands {
 public:
  /// Finds the islands of the rows on which impulses can act, and selects all of them. Islands are
  /// in the order of their first rows.
  void find(const RowList& rows, const Motion& motion, const Threads& threads);

  std::size_t count() const { return first_.size() - 1; }
  std::size_t row_count() const { return rows_.size(); }
  /// Rows of an island, in the order of the list.
  Span<const std::int32_t> rows_of(std::size_t island) const {
    return {rows_.data() + first_[island], first_[island + 1] - first_[island]};
  }
  /// Island of a body; -1 if no row moves it.
  std::int32_t of_body(std::int32_t body) const { return of_body_[body]; }
  /// The same for an index in Motion::rigid.
  std::int32_t of_rigid(std::size_t rigid) const { return of_rigid_[rigid]; }

  /// Whether the next solve includes the island. The others keep what they have.
  bool is_selected(std::size_t island) const { return selected_[island] != 0; }
  void select_none() { selected_.assign(count(), 0); }
  /// Selects the island of a body, if it is in one.
  void select_body(std::int32_t body) {
    if (of_body(body) >= 0) selected_[of_body(body)] = 1;
  }

 private:
  // Rows of a chunk that follow each other and move bodies of the same set.
  struct Run {
    std::int32_t set;
    std::size_t first, count;  // first: among the rows of its island
  };
  struct Chunk {
    std::vector<std::array<std::int32_t, 2>> joins;  // movable bodies that rows connect
    std::vector<Run> runs;
  };

  std::vector<std::int32_t> rows_;     // by island
  std::vector<std::size_t> first_{0};  // by island: of its rows; then the number of rows
  std::vector<std::int32_t> of_body_, of_rigid_;
  std::vector<char> selected_;  // by island
  // Scratch memory of find().
  std::vector<std::int32_t> body_of_row_;  // a body that the row moves, or -1
  std::vector<Chunk> chunks_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
