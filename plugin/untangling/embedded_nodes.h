// Pinned nodes inside of bodies that nothing moves: a curtain that is pinned in its rail, or pegs
// in the ground. Nothing can move them out. Pushing the free ends of their edges out would only
// stretch the cloth, so a body and the nodes inside of it count as anchored to each other.
//
// They are looked for where bodies are new, changed or were put elsewhere. A node is also changed
// when it is pinned or freed. Later only nodes that move relative to their body are looked at.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "motion/motion.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class EmbeddedNodes {
 public:
  using Pairs = std::vector<std::array<std::int32_t, 2>>;  ///< vertex, body; sorted

  /// Call when indices change. `keep_absent`: remembers bodies that take no part at present.
  void set_topology(const StepTopology& topology, bool keep_absent);
  /// Call after set_topology(). Looks at the pairs of which one body is in `placed`, which is
  /// sorted. `collide`: whether a soft body and an obstacle collide.
  void find(const StepTopology& topology, const Motion& motion,
            const std::vector<std::int32_t>& placed,
            const std::function<bool(std::int32_t soft_body, std::int32_t obstacle)>& collide);
  /// Forgets nodes that are outside at the start of the step, once no edge or face of theirs passes
  /// through the obstacle, and nodes that something moves now. Returns whether pairs() changed.
  bool forget_left(const StepTopology& topology, const Motion& motion);

  /// Of the present topology.
  const Pairs& pairs() const { return pairs_; }

 private:
  struct Entry {
    int soft_id, obstacle_id;            // StepTopology::ids()
    std::int32_t vertex;                 // in the soft body
    btVector3 place;                     // in the frame of the obstacle, when it was last looked at
    std::int32_t v = -1, obstacle = -1;  // in the present topology; -1: takes no part
    bool is_outside = false;             // by now
  };

  void find_pairs();
  // Sets Entry::is_outside of nodes that have moved relative to their obstacle.
  void find_outside(const StepTopology& topology, const Motion& motion);

  std::vector<Entry> entries_;
  Pairs pairs_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
