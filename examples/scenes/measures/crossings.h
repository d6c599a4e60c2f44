// Pass-throughs: pairs that the straight motion of their nodes between two consecutive steps brings
// into contact, in the positions that Bullet ended up with.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/detector.h"
#include "scenes/meshes/surface.h"

namespace lazyccd::scenes {

class CrossingCounter {
 public:
  explicit CrossingCounter(const PhysicsWorld& world);

  // To be called after each step.
  void step(const PhysicsWorld& world);

  std::int64_t vertex_face() const { return vertex_face_; }
  std::int64_t edge_edge() const { return edge_edge_; }

 private:
  Detector detector_;
  std::vector<btScalar> last_;
  std::int64_t vertex_face_ = 0, edge_edge_ = 0;
};

}  // namespace lazyccd::scenes
