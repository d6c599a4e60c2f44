// Parts what touches at the start of a step: bodies that an application puts exactly on each other.
//
// Where the distance is zero but for rounding, positions do not tell which side a body is on. It is
// decided here, once, when a body was placed, and before anything else looks at the step. The soft
// vertices then move to the distance of rounding on that side, start and end alike. From then on
// positions tell the side by themselves, to the detector, to simple shapes and to the response.
// On the way it must not pass through anything: a vertex that would keeps its place.
//
// The side of a solid is its outside. For two sheets there is one decision for each patch of pairs
// that share vertices, by the first of these that tells: the gaps; where the neighbours are; the
// motion that Bullet predicts, because they came from the sides that they move away from; the
// orientation of the faces.
#pragma once

#include <cstdint>
#include <vector>

#include "motion/motion.h"
#include "scene/step_topology.h"
#include "touching/touching_pairs.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class TouchingStarts {
 public:
  /// Forgets the vertices that moved in the last step.
  void begin_step() { moved_.clear(); }
  /// Moves free soft vertices of the pairs that touch. What leaves no room for that keeps touching.
  void part(const StepTopology& topology, Span<const Edge> edges, const TouchingQuery& query,
            Motion& motion);
  /// Whether part() moved this soft vertex in this step.
  bool has_moved(std::int32_t vertex) const;

 private:
  std::vector<std::int32_t> moved_;  // sorted
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
