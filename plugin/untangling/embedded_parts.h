// Parts of soft bodies inside of bodies that nothing moves, which stay there. A body and what is
// embedded in it count as anchored to each other.
//
// Pinned nodes: a curtain that is pinned in its rail, or pegs in the ground. Nothing can move them
// out. Pushing the free ends of their edges out would only stretch the cloth. They are looked for
// where bodies are new, changed or were put elsewhere. A node is also changed when it is pinned or
// freed.
//
// What is trapped: the middle of a carpet through which furniture stands on the floor, see
// find_in_convex(). The surface would keep inside what is inside, and hold edges where they pass
// through it. Below a ball that is a wedge, in which nothing comes to rest.
//
// Only what moves relative to its body is looked at again, and nodes that are outside, until their
// edges and faces have left too.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "motion/motion.h"
#include "motion/parts_inside.h"
#include "scene/step_topology.h"
#include "untangling/penetrations.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class EmbeddedParts {
 public:
  /// Call when indices change. `keep_absent`: remembers bodies that take no part at present.
  void set_topology(const StepTopology& topology, bool keep_absent);
  /// Finds pinned nodes. Call after set_topology(). Forgets what was found of the bodies in
  /// `placed`, and looks at the pairs of which one is in it. `placed` is sorted. `collide`: whether
  /// a soft body and an obstacle collide.
  void find_pinned(
      const StepTopology& topology, const Motion& motion, const std::vector<std::int32_t>& placed,
      const std::function<bool(std::int32_t soft_body, std::int32_t obstacle)>& collide);
  /// Takes what is trapped, and forgets trapped nodes that have a way out by now. Call where bodies
  /// are new or put elsewhere, and while they are being moved apart. Returns whether the parts
  /// changed.
  bool update_trapped(const StepTopology& topology, const Motion& motion,
                      const Penetrations& found);
  /// Forgets nodes that are outside at the start of the step, once no edge or face of theirs passes
  /// through the obstacle. So it does edges and faces that no longer pass through it, and pinned
  /// nodes that something moves now. Returns whether the parts changed.
  bool forget_left(const StepTopology& topology, const Motion& motion);

  /// In the present topology.
  const PartsInside& parts() const { return parts_; }
  const PartsInside& pinned() const { return pinned_; }  ///< those that are not trapped

 private:
  // A vertex, an edge or a face.
  struct Entry {
    int soft_id, obstacle_id;              // StepTopology::ids()
    std::array<std::int32_t, 3> vertices;  // in the soft body
    std::size_t count;                     // of vertices
    bool is_trapped;
    std::array<btVector3, 3> places;  // in the frame of the obstacle, when it was last looked at
    double depth;                     // metres, there: InsideVertex::depth, or 0
    std::array<std::int32_t, 3> v;    // in the present topology
    std::int32_t obstacle;            // in the present topology; -1: takes no part
    bool is_outside = false;          // by now; edges and faces: does not pass through

    Span<const std::int32_t> primitive() const { return {v.data(), count}; }
  };

  void add(Span<const std::int32_t> primitive, std::int32_t obstacle, bool is_trapped, double depth,
           const StepTopology& topology, const std::vector<int>& ids, const Motion& motion);
  void find_parts();
  // Sets Entry::is_outside of what has moved relative to its obstacle.
  void find_outside(const StepTopology& topology, const Motion& motion);
  // Returns whether it has, and remembers the new places if it has.
  static bool has_moved(Entry& entry, const Motion& motion);

  std::vector<Entry> entries_;
  PartsInside parts_, pinned_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
