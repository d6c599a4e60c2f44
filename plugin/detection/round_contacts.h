// Contacts of soft bodies with balls and capsules, met as what they are.
//
// The detector knows these obstacles as triangles. But where the edges of a soft body are short in
// comparison with the radius, its vertices alone decide: a face whose vertices stay away from the
// surface by some distance stays away too. So each vertex gets a constraint along the exact normal,
// and a bound shows that nothing touches. Where the bound does not hold, the detector decides.
//
// The bound. Let all vertices of a face be at least D away from a point q, and no two of them more
// than L apart. Then each point p of the face is at least sqrt(D^2 - L^2 / 3) away from q, because
// |p - q|^2 = sum_i w_i |v_i - q|^2 - sum_i w_i |v_i - p|^2 and the last sum is at most the squared
// circumradius, L^2 / 3. For an edge it is at most L^2 / 4. With q on the core of a ball or
// capsule, D is the distance from the core.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/pair_surfaces.h"
#include "detection/obstacle_pairs.h"
#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class RoundContacts {
 public:
  /// The arguments must outlive it.
  RoundContacts(const StepTopology& topology, const Motion& motion, const PairSurfaces& surfaces)
      : topology_(topology), motion_(motion), surfaces_(surfaces) {}

  /// Chooses the obstacles that are met here. Call when indices or pair rules change, with the
  /// start of a motion.
  void set_topology();
  /// Meets no obstacle until the next set_topology().
  void clear() { obstacles_.clear(); }
  bool any() const { return !obstacles_.empty(); }
  /// Changes the filters of a detector, such that it leaves out the pairs of these obstacles.
  void leave_out(std::vector<Body>& filters) const;

  /// Sets `contacts` to the vertices that come within `separation`, metres, of these obstacles in
  /// the motion: sorted, and as the detector reports vertices near faces.
  void find_near(double separation, std::vector<Contact>& contacts) const;
  /// True if it is certain that no soft body touches the triangles of these obstacles in the motion
  /// to its present end, or, with `at_start`, at its start.
  bool are_clear(bool at_start);

 private:
  // Core of a part over the motion, in the world.
  struct MovingCore;

  bool suits(const ObstaclePairs& obstacle) const;
  void find_near(const ObstaclePairs& obstacle, std::int32_t soft_body, const RoundPart& part,
                 double separation, std::vector<Contact>& contacts) const;
  bool is_clear(const ObstaclePairs& obstacle, bool at_start);
  bool is_clear(std::int32_t soft_body, const RoundPart& part, const RigidMotion& rigid,
                bool at_start);

  const StepTopology& topology_;
  const Motion& motion_;
  const PairSurfaces& surfaces_;
  std::vector<ObstaclePairs> obstacles_;
  // Scratch memory.
  EdgesSquared edges_squared_;
  std::vector<double> limits_;  // by vertex of a body: the largest sag with which the bound holds
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
