// Seams: nodes of one soft body that lie at the same place when the body is first seen.
//
// Meshes of garments have them where two panels meet, or where a vertex was doubled for its texture
// coordinates. A cut makes them too. Nothing holds these nodes together. Their triangles touch, but
// no side of one is outside of the other. So triangles that meet at a seam do not collide while it
// is closed. They do as soon as it has opened.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"
#include "scene/soft_scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Seams {
 public:
  /// Finds the seams of bodies that are new or have new nodes, and keeps those of the others. Call
  /// when indices of bodies or vertices change, with the start of a motion.
  void update(const SoftScene& scene, const Motion& motion);

  /// True if two primitives have vertices in one seam that are at most `distance` metres apart at
  /// the start of the motion.
  bool meet(Span<const std::int32_t> vertices_a, Span<const std::int32_t> vertices_b,
            double distance, const Motion& motion) const;
  bool any() const { return !seam_of_vertex_.empty(); }

 private:
  struct Nodes {
    int proxy_id = -1;  // tells the body from one that had its address before
    int count = 0;
    std::vector<std::int32_t>
        first;  // by node: the smallest node at its place; empty without seams
  };
  static void find(const SoftScene& scene, const SoftScene::BodyRecord& record,
                   const Motion& motion, Nodes& nodes);

  /// By address of a body, of all bodies that ever took part: a body that sleeps keeps its seams.
  std::map<const btSoftBody*, Nodes> nodes_of_;
  /// By soft vertex: a number for its seam, or -1. Empty if no body has one.
  std::vector<std::int32_t> seam_of_vertex_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
