// Edges that stick in faces where a step begins: what contact in continuous time cannot see, since
// nothing has to touch for it to last.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Indices of an edge and of the face that it sticks in.
struct Intersection {
  std::int32_t edge, face;
};

struct Intersections {
  std::vector<Intersection> pairs;
  BodyPair first = {-1, -1};  // bodies of an edge and of the face that it is in
};

// Of pairs that may collide, respond and are not `held` together, and that not only pinned vertices
// make up. What touches, and what is as near to it as rounding, does not count. For scenes that
// changed, not for every step.
Intersections find_intersections(const Topology& topology, Span<const Edge> edges,
                         const Positions& positions,
                         const std::function<bool(std::int32_t body)>& responds,
                         const std::function<bool(const Edge& edge, const Face& face)>& held);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
