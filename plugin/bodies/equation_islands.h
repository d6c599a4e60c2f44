// Divides the momentum equation of all bodies into systems that share no unknown, so that each is
// solved only until it has converged itself.
#pragma once

#include <BulletSoftBody/btDeformableBackwardEulerObjective.h>

#include <array>
#include <cstddef>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct EquationIsland {
  ScratchVector<int> bodies;    // indices in the objective's list, ascending
  ScratchVector<int> unknowns;  // of their nodes, then those of multipliers, each ascending
  std::size_t node_count = 0;

  Span<const int> multipliers() const {
    return {unknowns.data() + node_count, unknowns.size() - node_count};
  }
};

/// All bodies and unknowns of the objective as one island.
EquationIsland whole_equation(const btDeformableBackwardEulerObjective& objective, int nodes);

/// Divides the equation. Multipliers connect bodies, and so do `pairs` of bodies. A pair (b, b)
/// makes b an island of its own, unless something connects it with others. All bodies that nothing
/// connects with a pair are one island, the last one, as with Bullet. The result is one island if a
/// body has links or tetrahedra with another body's nodes.
ScratchVector<EquationIsland> find_equation_islands(
    const btDeformableBackwardEulerObjective& objective, int nodes,
    Span<const std::array<int, 2>> pairs);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
