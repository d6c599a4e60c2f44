// Which bodies come near each other at the start of a step.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"
#include "util/box.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// By body: nonzero if it is one of `bodies`; null stands for all.
inline std::vector<char> bodies_asked_for(const Topology& topology,
                                          const std::vector<std::int32_t>* bodies) {
  std::vector<char> is_asked_for(topology.bodies.size(), bodies == nullptr);
  if (bodies != nullptr)
    for (const std::int32_t body : *bodies) is_asked_for[body] = 1;
  return is_asked_for;
}

/// By body: nonzero if it collides with itself, or with a body whose box overlaps its own, and one
/// of both is asked for. `x`: positions of all vertices; the boxes are wider by `reach(v)`, metres.
template <class Reach, class Collide>
std::vector<char> find_bodies_that_meet(const Topology& topology, const std::vector<Vector3d>& x,
                                        const Reach& reach, const Collide& collide,
                                        const std::vector<char>& is_asked_for) {
  std::vector<Box3d> boxes(topology.bodies.size());
  for (std::size_t v = 0; v < x.size(); ++v) {
    const Vector3d spare = Vector3d::Constant(reach(static_cast<std::int32_t>(v)));
    boxes[topology.body_of_vertex[v]].extend(x[v] - spare).extend(x[v] + spare);
  }
  std::vector<char> meets(boxes.size(), 0);
  const auto count = static_cast<std::int32_t>(boxes.size());
  for (std::int32_t a = 0; a < count; ++a) {
    if (!is_asked_for[a]) continue;
    for (std::int32_t b = 0; b < count; ++b) {
      if (b < a && is_asked_for[b]) continue;  // known from b
      if (boxes[a].intersects(boxes[b]) && collide(a, b)) meets[a] = meets[b] = 1;
    }
  }
  return meets;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
