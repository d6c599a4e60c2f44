// Owner of the arrays that a Topology of the detector refers to.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The indices from `first` to `last` - 1.
struct IndexRange {
  std::int32_t first = 0, last = 0;
};

/// The primitives of a scene. For the meaning of each array see Topology (scene.h).
struct SceneTopology {
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<std::int32_t> body_of_vertex;
  std::vector<float> inverse_mass;  ///< 1/kg; 0: pinned
  std::vector<Body> bodies;
  std::vector<BodyPair> disabled_pairs;

  std::int32_t vertex_count() const { return static_cast<std::int32_t>(body_of_vertex.size()); }
  /// Valid until an array changes.
  Topology view() const {
    Topology t;
    t.vertex_count = body_of_vertex.size();
    t.faces = faces;
    t.edges = edges;
    t.body_of_vertex = body_of_vertex;
    t.inverse_mass = inverse_mass;
    t.bodies = bodies;
    t.disabled_pairs = disabled_pairs;
    return t;
  }
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
