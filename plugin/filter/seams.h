// Seams: nodes of one soft body that lie at the same place when the body is first seen.
//
// Meshes of garments have them where two panels meet, or where a vertex was doubled for its texture
// coordinates. A cut makes them too. Their triangles touch, but no side of one is outside of the
// other. So triangles that meet at a seam do not collide while it is closed. They do as soon as it
// has opened. A seam stays open, unless links or triangles sew its nodes together.
#pragma once

#include <cstdint>
#include <functional>
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
  /// Distance in metres up to which the seams of a body count as closed.
  using ClosedDistance = std::function<double(std::int32_t body)>;

  /// Finds the seams of bodies that are new or have new nodes, and keeps those of the others. Call
  /// when indices of bodies or vertices change, with the start of a motion; then find_closed().
  void update(const SoftScene& scene, const Motion& motion);
  /// Finds which seams are closed at the start of a motion.
  void find_closed(const SoftScene& scene, const Motion& motion, const ClosedDistance& distance);

  /// True if two primitives have vertices in one closed seam.
  bool meet(Span<const std::int32_t> vertices_a, Span<const std::int32_t> vertices_b) const;

 private:
  struct Nodes {
    int proxy_id = -1;  // tells the body from one that had its address before
    int count = 0;
    // By node: the smallest node at its place. Empty without seams.
    std::vector<std::int32_t> first;
    std::vector<char> is_sewn;  // by node that is the first of a seam
  };
  // A vertex in a seam that begins with another vertex.
  struct Member {
    std::int32_t vertex, first;
    bool is_sewn;
  };
  static void find(const SoftScene& scene, const SoftScene::BodyRecord& record,
                   const Motion& motion, Nodes& nodes);
  static void find_sewn(const btSoftBody& body, Nodes& nodes);

  /// By address of a body, of all bodies that ever took part: a body that sleeps keeps its seams.
  std::map<const btSoftBody*, Nodes> nodes_of_;
  std::vector<Member> members_;
  /// By soft vertex: the first vertex of its seam if that is closed, or -1. Empty without seams.
  std::vector<std::int32_t> closed_seam_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
