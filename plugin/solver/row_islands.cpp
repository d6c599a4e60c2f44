#include "solver/row_islands.h"

#include <algorithm>

#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// By index in Motion::rigid: the body.
std::vector<std::int32_t> bodies_of_rigid(const Motion& motion) {
  std::vector<std::int32_t> bodies(motion.rigid.size(), -1);
  for (std::size_t body = 0; body < motion.rigid_of_body.size(); ++body) {
    const int rigid = motion.rigid_of_body[body];
    if (rigid >= 0) bodies[rigid] = static_cast<std::int32_t>(body);
  }
  return bodies;
}

std::int32_t body_of_vertex(std::int32_t vertex, const Motion& motion) {
  const auto next =
      std::upper_bound(motion.first_vertex.begin(), motion.first_vertex.end(), vertex);
  return static_cast<std::int32_t>(next - motion.first_vertex.begin()) - 1;
}

}  // namespace

void RowIslands::find(const RowList& rows, const Motion& motion, const Threads& threads) {
  DisjointSets sets(motion.rigid_of_body.size());
  const auto is_movable = [&motion](std::int32_t body) {
    const int rigid = motion.rigid_of_body[body];
    return rigid < 0 || motion.rigid[rigid].is_movable();
  };
  const std::vector<std::int32_t> body_of_rigid = bodies_of_rigid(motion);
  // Contacts of an anchored vertex push the body that it is anchored to.
  for (const auto& [vertex, anchored] : motion.anchored)
    sets.join(body_of_vertex(vertex, motion), body_of_rigid[anchored.rigid]);
  for (const ArticulatedMotion& multibody : motion.articulated) {
    for (const ArticulatedMotion::Link& link : multibody.links)
      sets.join(body_of_rigid[multibody.links.front().rigid], body_of_rigid[link.rigid]);
  }
  // By row: the movable bodies that it connects; the same one twice if there is one, -1 if the row
  // cannot act.
  bodies_of_row_.resize(rows.size());
  threads.parallel_for(rows.size(), 4096, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      bodies_of_row_[i] = {-1, -1};
      if (!rows.can_act(i)) continue;
      const std::int32_t a = rows.contact(i).body_a, b = rows.contact(i).body_b;
      bodies_of_row_[i] = {is_movable(a) ? a : b, is_movable(b) ? b : a};
    }
  });
  for (const auto& [a, b] : bodies_of_row_) {
    if (a != b) sets.join(a, b);
  }

  std::vector<std::int32_t> island_of_set(sets.size(), -1);
  std::vector<std::size_t> counts;
  for (auto& bodies : bodies_of_row_) {
    std::int32_t& of_row = bodies[0];  // from here on: the island
    if (of_row < 0) continue;
    std::int32_t& island = island_of_set[sets.find(of_row)];
    if (island < 0) {
      island = static_cast<std::int32_t>(counts.size());
      counts.push_back(0);
    }
    of_row = island;
    ++counts[island];
  }
  first_.assign(counts.size() + 1, 0);
  for (std::size_t i = 0; i < counts.size(); ++i) first_[i + 1] = first_[i] + counts[i];
  rows_.resize(first_.back());
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t i = 0; i < bodies_of_row_.size(); ++i) {
    const std::int32_t island = bodies_of_row_[i][0];
    if (island >= 0) rows_[next[island]++] = static_cast<std::int32_t>(i);
  }
  of_body_.assign(sets.size(), -1);
  of_rigid_.assign(motion.rigid.size(), -1);
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(sets.size()); ++body) {
    if (!is_movable(body)) continue;
    of_body_[body] = island_of_set[sets.find(body)];
    const int rigid = motion.rigid_of_body[body];
    if (rigid >= 0) of_rigid_[rigid] = of_body_[body];
  }
  selected_.assign(counts.size(), 1);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
