// Counts pass-throughs: pairs of primitives that come into contact between the end positions of two
// consecutive steps, if all nodes move along straight lines.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/detector.h"
#include "scenes/meshes/surface.h"

namespace lazyccd::scenes {

/// Counts the pass-throughs of a world. The bodies must stay the same.
class CrossingCounter {
 public:
  explicit CrossingCounter(const PhysicsWorld& world);

  /// Counts the pass-throughs of one step. Call it after each step.
  void step(const PhysicsWorld& world);

  std::int64_t vertex_face() const { return vertex_face_; }
  std::int64_t edge_edge() const { return edge_edge_; }

 private:
  Detector detector_;
  std::vector<btScalar> last_;  // positions after the previous step
  std::int64_t vertex_face_ = 0, edge_edge_ = 0;
};

}  // namespace lazyccd::scenes
