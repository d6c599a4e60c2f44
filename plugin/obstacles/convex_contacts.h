// Contacts of soft bodies with boxes, hulls, cylinders, cones and planes, met as convex polyhedra.
//
// The detector knows these obstacles as triangles. Here each vertex gets a constraint with the side
// that it meets first. A face or an edge that lies above one side is held there by its own
// vertices. One that bends around an edge of the polyhedron has a constraint of its own, along the
// plane between both. The same planes show that nothing touches. Where they do not, the detector
// decides.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/pair_surfaces.h"
#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "obstacles/convex_pair.h"
#include "obstacles/obstacle_pairs.h"
#include "obstacles/soft_bounds.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ConvexContacts {
 public:
  /// The arguments must outlive it.
  ConvexContacts(const StepTopology& topology, const Motion& motion, const PairSurfaces& surfaces,
                 SoftBounds& soft_bounds)
      : topology_(topology), motion_(motion), surfaces_(surfaces), soft_bounds_(soft_bounds) {}

  /// True if the parts of an obstacle that are not round can be met here.
  bool may_be_met(const ObstaclePairs& obstacle) const;
  /// Meets these parts of the obstacles. Call when indices or pair rules change, with the start of
  /// a motion.
  void set_obstacles(const std::vector<ObstaclePairs>& obstacles);
  /// Meets this obstacle no longer.
  void give_up(std::int32_t body);

  /// Sets `contacts` to what comes within `separation`, metres, of these parts in the motion,
  /// sorted. Vertices are reported as the detector reports vertices near faces, and edges as it
  /// reports them near edges. Call once in each motion, first; the soft bounds must have begun it.
  /// Adds to `entered` the obstacles in which a vertex starts; none of their contacts are in
  /// `contacts`.
  void find_near(double separation, std::vector<Contact>& contacts,
                 std::vector<std::int32_t>& entered);
  /// Adds to `unclear` the obstacles whose parts a soft body may touch: in the motion to its
  /// present end, or, with `at_start`, at its start. The soft bounds have begun that.
  void find_unclear(bool at_start, std::vector<std::int32_t>& unclear);

 private:
  /// A part of an obstacle, with each soft body that may meet it.
  struct Part {
    MovingPolyhedron polyhedron;
    std::vector<ConvexPair> pairs;
  };
  struct Obstacle {
    ObstaclePairs bodies;
    std::vector<Part> parts;
  };

  bool find_near(Obstacle& obstacle, double separation, std::vector<Contact>& contacts);
  bool is_clear(Obstacle& obstacle);
  /// Calls `visit` for each pair of an obstacle whose bounds come within `distance`, metres, until
  /// it returns false. Returns whether it never did.
  template <class Visit>
  bool all_near(Obstacle& obstacle, double distance, const Visit& visit);

  const StepTopology& topology_;
  const Motion& motion_;
  const PairSurfaces& surfaces_;
  SoftBounds& soft_bounds_;
  std::vector<Obstacle> obstacles_;
  bool at_start_ = false;  // in the call that runs
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
