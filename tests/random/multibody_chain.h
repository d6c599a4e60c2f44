// A multi-body at random: boxes that hang from each other by joints.
#pragma once

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <memory>
#include <vector>

#include "random/random_source.h"
#include "scenes/meshes/tessellation.h"

namespace lazyccd::test {

class Chain {
 public:
  // Its first link hangs at `place`; each is `length` metres long and turns at up to `spin` rad/s.
  Chain(const btVector3& place, double length, double angular_velocity, RandomSource& random);
  ~Chain() { remove(); }

  void add_to(btMultiBodyDynamicsWorld& world);
  void remove();

  const std::vector<std::unique_ptr<btMultiBodyLinkCollider>>& links() const { return links_; }
  // Of a link, in its frame.
  const scenes::Triangles& surface() const { return surface_; }

 private:
  btBoxShape shape_;
  scenes::Triangles surface_;
  std::unique_ptr<btMultiBody> body_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> links_;
  btMultiBodyDynamicsWorld* world_ = nullptr;
};

}  // namespace lazyccd::test
