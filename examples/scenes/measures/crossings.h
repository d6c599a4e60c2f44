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
  /// For primitives that the caller reads: the topology, and the coordinates at the start.
  CrossingCounter(const Surface& surface, std::vector<btScalar> positions);

  /// Counts the pass-throughs of one step. Call it after each step.
  void step(const PhysicsWorld& world);
  void step(std::vector<btScalar> positions);
  /// Goes on from these positions without a count.
  void jump(std::vector<btScalar> positions) { last_.swap(positions); }

  std::int64_t vertex_face() const { return vertex_face_; }
  std::int64_t edge_edge() const { return edge_edge_; }

 private:
  Detector detector_;
  std::vector<btScalar> last_;  // positions after the previous step
  std::int64_t vertex_face_ = 0, edge_edge_ = 0;
};

}  // namespace lazyccd::scenes
