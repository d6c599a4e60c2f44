// Contacts of soft bodies with balls and capsules, met as what they are.
//
// The detector knows these obstacles as triangles. Here each vertex gets a constraint along the
// exact normal. Where the edges of a soft body are short in comparison with the radius, the
// vertices alone decide: a face whose vertices stay away from the surface by some distance stays
// away too. A face or an edge that is too large for that has a constraint of its own, at the point
// that is closest to the surface. A bound or a plane between both shows that nothing touches.
// Where neither does, the detector decides.
//
// The bound. Let all vertices v_i of a face be at least D away from a point q, and let r be the
// radius of the smallest ball around the face. Then each point p = sum_i w_i v_i of the face is at
// least sqrt(D^2 - r^2) away from q, because |p - q|^2 = sum_i w_i |v_i - q|^2 - sum_i w_i |v_i -
// p|^2. The last sum is smallest for p, and with the centre of the ball in place of p it is at most
// r^2. The same holds for edges. With q on the core of a ball or capsule, D is the distance from
// the core.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/pair_surfaces.h"
#include "filter/contact_filter.h"
#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "obstacles/moving_core.h"
#include "obstacles/obstacle_pairs.h"
#include "obstacles/soft_bounds.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class RoundContacts {
 public:
  /// The arguments must outlive it.
  RoundContacts(const StepTopology& topology, const Motion& motion, const PairSurfaces& surfaces,
                const ContactFilter& filter, SoftBounds& soft_bounds)
      : topology_(topology),
        motion_(motion),
        surfaces_(surfaces),
        filter_(filter),
        soft_bounds_(soft_bounds) {}

  /// True if the parts of an obstacle that are balls and capsules can be met here.
  bool may_be_met(const ObstaclePairs& obstacle) const;
  /// Meets these parts of the obstacles. Call when indices or pair rules change, with the start of
  /// a motion.
  void set_obstacles(const std::vector<ObstaclePairs>& obstacles);
  /// Meets this obstacle no longer.
  void give_up(std::int32_t body);

  /// Sets `contacts` to what comes within `separation`, metres, of these parts in the motion,
  /// sorted. The soft bounds must have begun the motion. Vertices are reported as the detector
  /// reports vertices near faces. Faces and edges that need a constraint of their own are reported
  /// with the edge or the vertex of the obstacle that is nearest to the contact point.
  void find_near(double separation, std::vector<Contact>& contacts);
  /// Adds to `unclear` the obstacles whose parts a soft body may touch: in the motion to its
  /// present end, or, with `at_start`, at its start. The soft bounds have begun that. What an
  /// anchor holds to the obstacle does not count: its contacts are ignored.
  void find_unclear(bool at_start, std::vector<std::int32_t>& unclear);

 private:
  // A part of an obstacle and a soft body near it.
  struct Pair {
    std::int32_t soft_body, obstacle;
    const RoundPart& part;
    const MovingCore& core;
  };
  // Where the line from the core to the contact point leaves the triangles.
  struct Exit {
    Vector3d normal;    // unit length, outward
    std::int32_t face;  // in the topology
    Face corners;
    btScalar u, v;  // on the face, as FacePoint
  };

  double kept_distance(std::int32_t soft_body, std::int32_t obstacle, const RoundPart& part) const;
  void find_near(const Pair& pair, double separation, std::vector<Contact>& contacts);
  template <class Primitives>
  void find_near(const Pair& pair, double near_distance, const Primitives& primitives,
                 const std::vector<std::int32_t>& indices, std::int32_t first_edge_index,
                 std::vector<Contact>& contacts) const;
  Exit exit_of(const Pair& pair, const ClosestPoints& points) const;
  Contact vertex_contact(const Pair& pair, std::int32_t vertex, double time,
                         const ClosestPoints& points) const;
  template <class Primitive>
  Contact contact_at(const Pair& pair, const Primitive& primitive, std::int32_t index,
                     std::int32_t first_edge_index, double time, const ClosestPoints& points) const;
  bool is_clear(const ObstaclePairs& obstacle, bool at_start);
  bool is_clear(const Pair& pair, bool at_start);

  const StepTopology& topology_;
  const Motion& motion_;
  const PairSurfaces& surfaces_;
  const ContactFilter& filter_;
  SoftBounds& soft_bounds_;
  std::vector<ObstaclePairs> obstacles_;
  /// By soft body, metres: vertices farther away than this have no face or edge that needs a
  /// constraint. Twice what it is at the start of the topology; the detector decides about what
  /// stretches more.
  std::vector<double> reach_;
  /// By vertex of a body, of those that may be near. In find_near(): lower bound of its distance
  /// from the core, metres. In is_clear(): the largest sag with which the bound holds, m^2.
  std::vector<double> by_vertex_;
  std::vector<std::int32_t> anchored_;  ///< vertices of a pair, in is_clear()
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
