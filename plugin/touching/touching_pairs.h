// Finds what touches at the start of a step: primitives of different bodies whose distance rounding
// cannot tell from zero.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "scene/step_topology.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A vertex and a face, or two edges. At least one of them is soft.
struct TouchingPair {
  Contact contact;                ///< kind, bodies, primitives and vertices; the rest is not set
  std::array<double, 4> weights;  ///< of the closest points, as Contact::weights()
  Vector3d gap;                   ///< from the closest point of b to that of a, metres
};

/// What is looked at.
struct TouchingQuery {
  /// Whether two bodies collide.
  std::function<bool(std::int32_t a, std::int32_t b)> collide;
  /// Whether the response acts on a pair.
  std::function<bool(const Contact&)> responds;
  /// Pairs that touch in the motion of all vertices from `start` to `end`. Valid until the next
  /// call.
  std::function<Span<const Contact>(const Positions& start, const Positions& end)> touching;
  /// Edges that pass through faces where the vertices start now: two vertices of an edge, three of
  /// a face; sorted. Pairs that rounding cannot tell from touching do not count.
  std::function<std::vector<std::array<std::int32_t, 5>>()> piercing;
  /// Only pairs with one of these bodies. Must be set, and outlive the query.
  const std::vector<std::int32_t>* of_bodies = nullptr;
};

/// `x`: positions of all vertices, metres. `rounding`: by vertex, metres; a pair touches if its
/// distance is at most that of one of its vertices.
std::vector<TouchingPair> find_touching_pairs(const Topology& topology, Span<const Edge> edges,
                                              const std::vector<Vector3d>& x,
                                              const std::vector<double>& rounding,
                                              std::int32_t soft_count, const TouchingQuery& query);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
