// The scenes whose steps are timed: common ones of games, and those of users who tune nothing.
#pragma once

#include <BulletCollision/CollisionShapes/btCompoundShape.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "scenes/meshes/shapes.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes {

struct CostScene {
  std::string name;
  std::function<void(PhysicsWorld&)> build;
  double seconds = 1;
  /// Steps that are not timed: they build persistent data, and sleepers are left out after some.
  int warm_up_steps = 1;
  bool only_by_name = false;  ///< takes so long that it runs only if --only names it
  bool untuned = false;       ///< margins are Bullet's defaults
  bool rigid_only = false;    ///< Bullet alone may crash in the deformable world
  double margin = 0.01;       ///< of every body, unless untuned
  double gravity = 10;        ///< units of length per s^2; 1 000 where a unit is a centimetre
};

/// Bodies of several convex shapes. Owns its children and knows their surfaces.
class Character : public btCompoundShape {
 public:
  struct Part {
    std::unique_ptr<btCollisionShape> shape;
    btTransform pose;
    Triangles surface;
  };

  void add(std::unique_ptr<btCollisionShape> child, const btTransform& pose);
  const std::vector<Part>& parts() const { return parts_; }

 private:
  std::vector<Part> parts_;
};

/// Those of this folder, and untuned and reported ones.
std::vector<CostScene> cost_scenes();
/// Scenes after those that users reported as slow.
std::vector<CostScene> reported_scenes();

}  // namespace lazyccd::scenes
