// A random multibody: a chain of one to three boxes, connected by revolute joints.
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

/// A chain of boxes. The base is fixed; every link has a collider.
class Chain {
 public:
  /// Creates the chain. `place` is the position of the base, where the first joint is.
  /// `length`: distance from one joint to the next, metres. `angular_velocity`: largest initial
  /// velocity of a joint, rad/s.
  Chain(const btVector3& place, double length, double angular_velocity, RandomSource& random);
  ~Chain() { remove(); }

  /// Adds the multibody and its colliders to `world`, which must outlive this object or remove().
  void add_to(btMultiBodyDynamicsWorld& world);
  /// Removes everything from the world again. No effect without add_to().
  void remove();

  const std::vector<std::unique_ptr<btMultiBodyLinkCollider>>& links() const { return links_; }
  /// Triangles of one link, in the link's frame; the same for all links.
  const scenes::Triangles& surface() const { return surface_; }

 private:
  btBoxShape shape_;
  scenes::Triangles surface_;
  std::unique_ptr<btMultiBody> body_;
  std::vector<std::unique_ptr<btMultiBodyLinkCollider>> links_;
  btMultiBodyDynamicsWorld* world_ = nullptr;
};

}  // namespace lazyccd::test
