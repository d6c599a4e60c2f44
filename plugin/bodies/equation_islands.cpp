#include "bodies/equation_islands.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "bodies/side_by_side.h"
#include "lazyccd/debug/assert.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

EquationIsland whole_equation(const btDeformableBackwardEulerObjective& objective, int nodes) {
  EquationIsland all;
  all.bodies.resize(static_cast<std::size_t>(objective.m_softBodies.size()));
  std::iota(all.bodies.begin(), all.bodies.end(), 0);
  all.node_count = static_cast<std::size_t>(nodes);
  all.unknowns.resize(all.node_count + static_cast<std::size_t>(
                                           objective.m_projection.m_lagrangeMultipliers.size()));
  std::iota(all.unknowns.begin(), all.unknowns.end(), 0);
  return all;
}

ScratchVector<EquationIsland> find_equation_islands(
    const btDeformableBackwardEulerObjective& objective, int nodes,
    Span<const std::array<int, 2>> pairs) {
  const btAlignedObjectArray<btSoftBody*>& bodies = objective.m_softBodies;
  const btAlignedObjectArray<LagrangeMultiplier>& multipliers =
      objective.m_projection.m_lagrangeMultipliers;
  ScratchVector<int> first_node(1, 0);
  bool are_alone = true;
  for (int b = 0; b < bodies.size(); ++b) {
    first_node.push_back(first_node.back() + bodies[b]->m_nodes.size());
    are_alone = are_alone && has_own_links(*bodies[b]) && has_own_tetrahedra(*bodies[b]);
  }
  if (!are_alone || bodies.size() < 2) return {whole_equation(objective, nodes)};
  const auto body_of = [&](int node) {
    const auto after = std::upper_bound(first_node.begin(), first_node.end(), node);
    return static_cast<std::int32_t>(after - first_node.begin()) - 1;
  };
  DisjointSets sets(static_cast<std::size_t>(bodies.size()));
  for (const std::array<int, 2>& pair : pairs) sets.join(pair[0], pair[1]);
  for (int c = 0; c < multipliers.size(); ++c)
    for (int i = 1; i < multipliers[c].m_num_nodes; ++i)
      sets.join(body_of(multipliers[c].m_indices[0]), body_of(multipliers[c].m_indices[i]));
  ScratchVector<char> has_pair(static_cast<std::size_t>(bodies.size()), 0);  // by set
  for (const std::array<int, 2>& pair : pairs)
    has_pair[static_cast<std::size_t>(sets.find(pair[0]))] = 1;

  ScratchVector<EquationIsland> islands;
  EquationIsland others;
  ScratchVector<int> island_of_set(static_cast<std::size_t>(bodies.size()), -1);
  const auto island_of = [&](std::int32_t body) -> EquationIsland& {
    const auto set = static_cast<std::size_t>(sets.find(body));
    if (!has_pair[set]) return others;
    if (island_of_set[set] < 0) {
      island_of_set[set] = static_cast<int>(islands.size());
      islands.emplace_back();
    }
    return islands[static_cast<std::size_t>(island_of_set[set])];
  };
  for (int b = 0; b < bodies.size(); ++b) {
    EquationIsland& island = island_of(b);
    island.bodies.push_back(b);
    for (int i = 0; i < bodies[b]->m_nodes.size(); ++i)
      island.unknowns.push_back(first_node[static_cast<std::size_t>(b)] + i);
    island.node_count = island.unknowns.size();
  }
  for (int c = 0; c < multipliers.size(); ++c)
    island_of(body_of(multipliers[c].m_indices[0])).unknowns.push_back(nodes + c);
  if (!others.bodies.empty()) islands.push_back(std::move(others));
  LAZYCCD_ASSERT(std::accumulate(islands.begin(), islands.end(), 0,
                                 [](int sum, const EquationIsland& island) {
                                   return sum + static_cast<int>(island.unknowns.size());
                                 }) == nodes + multipliers.size(),
                 "each unknown of the equation is in one island");
  return islands;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
