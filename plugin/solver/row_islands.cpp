#include "solver/row_islands.h"

#include <algorithm>

#include "lazyccd/debug/assert.h"
#include "motion/articulated_motion.h"
#include "util/disjoint_sets.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// By index in Motion::rigid: the body.
ScratchVector<std::int32_t> bodies_of_rigid(const Motion& motion) {
  ScratchVector<std::int32_t> bodies(motion.rigid().size(), -1);
  for (std::size_t body = 0; body < motion.rigid_of_body().size(); ++body) {
    const int rigid = motion.rigid_of_body()[body];
    if (rigid >= 0) bodies[rigid] = static_cast<std::int32_t>(body);
  }
  return bodies;
}

std::int32_t body_of_vertex(std::int32_t vertex, const Motion& motion) {
  const auto next =
      std::upper_bound(motion.first_vertex().begin(), motion.first_vertex().end(), vertex);
  return static_cast<std::int32_t>(next - motion.first_vertex().begin()) - 1;
}

// Whether each row that can act is in one island, with all that it moves.
bool are_disjoint(const RowIslands& islands, const RowList& rows) {
  ScratchVector<char> is_in(rows.size(), 0);
  for (std::size_t island = 0; island < islands.count(); ++island) {
    for (const std::int32_t row : islands.rows_of(island)) {
      if (is_in[row]++ != 0) return false;
      const Contact& contact = rows.contact(static_cast<std::size_t>(row));
      for (const std::int32_t body : {contact.body_a, contact.body_b}) {
        const std::int32_t of_body = islands.of_body(body);
        if (of_body >= 0 && of_body != static_cast<std::int32_t>(island)) return false;
      }
    }
  }
  for (std::size_t row = 0; row < rows.size(); ++row)
    if (rows.can_act(row) != (is_in[row] != 0)) return false;
  return true;
}

}  // namespace

void RowIslands::find(const RowList& rows, const Motion& motion, const Threads& threads) {
  DisjointSets sets(motion.rigid_of_body().size());
  const auto is_movable = [&motion](std::int32_t body) {
    const int rigid = motion.rigid_of_body()[body];
    return rigid < 0 || motion.rigid()[rigid].is_movable();
  };
  const ScratchVector<std::int32_t> body_of_rigid = bodies_of_rigid(motion);
  // Contacts of an anchored vertex push the body that it is anchored to.
  for (const auto& [vertex, anchored] : motion.anchored())
    sets.join(body_of_vertex(vertex, motion), body_of_rigid[anchored.rigid]);
  for (const ArticulatedMotion& multibody : motion.articulated) {
    for (const ArticulatedMotion::Link& link : multibody.links)
      sets.join(body_of_rigid[multibody.links.front().rigid], body_of_rigid[link.rigid]);
  }
  constexpr std::size_t grain = 4096;
  body_of_row_.resize(rows.size());
  chunks_.resize((rows.size() + grain - 1) / grain);
  const auto for_each_chunk = [&](const auto& each) {
    threads.parallel_for(chunks_.size(), 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i)
        each(chunks_[i], i * grain, std::min((i + 1) * grain, rows.size()));
    });
  };
  for_each_chunk([&](Chunk& chunk, std::size_t first, std::size_t last) {
    chunk.joins.clear();
    for (std::size_t i = first; i < last; ++i) {
      body_of_row_[i] = -1;
      if (!rows.can_act(i)) continue;
      const std::int32_t a = rows.contact(i).body_a, b = rows.contact(i).body_b;
      const std::array<std::int32_t, 2> moved = {is_movable(a) ? a : b, is_movable(b) ? b : a};
      body_of_row_[i] = moved[0];
      if (moved[0] != moved[1] && (chunk.joins.empty() || chunk.joins.back() != moved))
        chunk.joins.push_back(moved);
    }
  });
  for (const Chunk& chunk : chunks_)
    for (const auto& [a, b] : chunk.joins) sets.join(a, b);
  ScratchVector<std::int32_t> set_of_body(sets.size());
  for (std::size_t body = 0; body < sets.size(); ++body)
    set_of_body[body] = sets.find(static_cast<std::int32_t>(body));

  for_each_chunk([&](Chunk& chunk, std::size_t first, std::size_t last) {
    chunk.runs.clear();
    for (std::size_t i = first; i < last; ++i) {
      if (body_of_row_[i] < 0) continue;
      const std::int32_t set = set_of_body[body_of_row_[i]];
      if (chunk.runs.empty() || chunk.runs.back().set != set) chunk.runs.push_back({set, 0, 0});
      ++chunk.runs.back().count;
    }
  });
  ScratchVector<std::int32_t> island_of_set(sets.size(), -1);
  ScratchVector<std::size_t> counts;
  for (Chunk& chunk : chunks_) {
    for (Run& run : chunk.runs) {
      std::int32_t& island = island_of_set[run.set];
      if (island < 0) {
        island = static_cast<std::int32_t>(counts.size());
        counts.push_back(0);
      }
      run.first = counts[island];
      counts[island] += run.count;
    }
  }
  first_.assign(counts.size() + 1, 0);
  for (std::size_t i = 0; i < counts.size(); ++i) first_[i + 1] = first_[i] + counts[i];
  rows_.resize(first_.back());
  for_each_chunk([&](const Chunk& chunk, std::size_t first, std::size_t) {
    std::size_t i = first;
    for (const Run& run : chunk.runs) {
      std::int32_t* to = &rows_[first_[island_of_set[run.set]] + run.first];
      for (std::size_t left = run.count; left > 0; ++i) {
        if (body_of_row_[i] < 0) continue;
        *to++ = static_cast<std::int32_t>(i);
        --left;
      }
    }
  });
  of_body_.assign(sets.size(), -1);
  of_rigid_.assign(motion.rigid().size(), -1);
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(sets.size()); ++body) {
    if (!is_movable(body)) continue;
    of_body_[body] = island_of_set[sets.find(body)];
    const int rigid = motion.rigid_of_body()[body];
    if (rigid >= 0) of_rigid_[rigid] = of_body_[body];
  }
  selected_.assign(counts.size(), 1);
  LAZYCCD_ASSERT(are_disjoint(*this, rows), "islands share no row and nothing that rows move");
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
