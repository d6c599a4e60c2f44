// Contacts of soft bodies with boxes and planes that they meet at one side, far from the edges.
//
// The detector knows these obstacles as triangles. But what lies on a floor or a table meets one
// plane, and its vertices alone decide: if all of them stay in front of the plane, nothing touches.
// So each vertex gets a constraint along the normal of the side, and the same plane shows that
// nothing touches. As soon as a soft body comes near an edge of an obstacle, the detector takes the
// obstacle over, until the next topology. Where the plane does not hold in a step, the detector
// decides.
//
// The plane. All vertices move in straight lines. In a fixed direction n, the obstacle's vertices
// reach at most o0 at the start of the motion and o1 at its end, so the triangles between them
// reach at most (1 - t) o0 + t o1 at time t. A soft face whose vertices are beyond o0 at the start
// and beyond o1 at the end is beyond that at all times.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "detection/obstacle_pairs.h"
#include "lazyccd/contact.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class FlatContacts {
 public:
  /// The arguments must outlive it.
  FlatContacts(const StepTopology& topology, const Motion& motion)
      : topology_(topology), motion_(motion) {}

  /// Chooses the obstacles that are met here. Call when indices or pair rules change.
  void set_topology();
  /// Meets no obstacle until the next set_topology().
  void clear() { obstacles_.clear(); }
  bool any() const { return !obstacles_.empty(); }
  /// Changes the filters of a detector, such that it leaves out the pairs of these obstacles.
  void leave_out(std::vector<Body>& filters) const;

  /// Sets `contacts` to the vertices that come within `separation`, metres, of these obstacles in
  /// the motion: sorted, and as the detector reports vertices near faces. Call once in each motion,
  /// first. Returns false if it gives up an obstacle: the detector needs new filters then.
  bool find_near(double separation, std::vector<Contact>& contacts);
  /// True if it is certain that no soft body touches the triangles of these obstacles in the motion
  /// to its present end, or, with `at_start`, at its start.
  bool are_clear(bool at_start);

 private:
  struct Obstacle {
    ObstaclePairs pairs;
    bool was_clear = true;    // in the last motion
    int unclear_motions = 0;  // in succession
  };
  // A side of a part in the world.
  struct MovingSide {
    Eigen::Vector3d normal;      // unit length, at the start
    double start, end;           // how far the part reaches along `normal`, metres
    const FlatPart::Side* side;  // for its faces
  };

  // Sets sides_ to those of a part.
  void set_sides(const ObstaclePairs& obstacle, const FlatPart& part, bool at_start);
  // These two are about the part of sides_.
  bool find_near(const ObstaclePairs& obstacle, std::int32_t soft_body, double separation,
                 double longest_edge, std::vector<Contact>& contacts) const;
  bool is_clear(std::int32_t soft_body, bool at_start);
  Contact contact_at(const ObstaclePairs& obstacle, std::int32_t vertex, const MovingSide& side,
                     double time) const;
  bool is_clear(const ObstaclePairs& obstacle, bool at_start);

  const StepTopology& topology_;
  const Motion& motion_;
  std::vector<Obstacle> obstacles_;
  // Scratch memory.
  std::vector<MovingSide> sides_;
  std::vector<std::uint32_t> beyond_;  // by vertex of a body: a bit for each side that it is beyond
  std::vector<double> longest_edges_;  // by body, metres; negative: not measured yet
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
