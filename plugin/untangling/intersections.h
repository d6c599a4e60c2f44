// Finds edges that intersect faces at the start of a step. Continuous collision detection cannot
// see these, because an intersection can last without anything touching.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// True if the edge pq passes through the face abc. Touching, and what rounding cannot tell from
/// it, does not count.
bool edge_intersects_face(const Vector3d& p, const Vector3d& q, const Vector3d& a,
                          const Vector3d& b, const Vector3d& c);

/// Indices of an edge and of the face that it intersects.
struct Intersection {
  std::int32_t edge, face;
};

struct Intersections {
  std::vector<Intersection> pairs;
  BodyPair first = {-1, -1};  ///< bodies of the edge and of the face of the first intersection
};

/// Finds the intersections of pairs that may collide, respond, are not ignored and have at least
/// one movable vertex. Pairs that touch, or that rounding cannot tell from touching, do not count.
/// `of_bodies`: only pairs with one of these bodies; null: all pairs. What is far from them costs
/// little then.
/// Meant for scenes that changed, not for every step.
Intersections find_intersections(
    const Topology& topology, Span<const Edge> edges, const Positions& positions,
    const std::function<bool(std::int32_t body)>& responds,
    const std::function<bool(const Edge& edge, const Face& face)>& is_ignored,
    const std::vector<std::int32_t>* of_bodies = nullptr);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
