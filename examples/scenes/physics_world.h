// A Bullet world of either kind, with LazyCCD or with Bullet's own soft body collisions.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <memory>
#include <string>
#include <vector>

#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"

namespace lazyccd::scenes {

enum class World {
  rigid,
  deformable
};  // btSoftRigidDynamicsWorld, btDeformableMultiBodyDynamicsWorld
enum class Collisions { lazyccd, bullet };  // whose

struct WorldOptions {
  World world = World::deformable;
  Collisions collisions = Collisions::lazyccd;
  double dt = 1.0 / 240;  // s
  double gravity = 0;     // m/s^2, downwards (-y)
  double margin = 0.01;   // m, of every body
  // With LazyCCD in the deformable world: Bullet's own world class, its passes over soft pairs
  // included.
  bool stock_world = false;
  bullet::Options lazyccd;
};

class PhysicsWorld {
 public:
  static std::unique_ptr<PhysicsWorld> make(const WorldOptions& options);
  virtual ~PhysicsWorld() = default;

  const WorldOptions& options() const { return options_; }

  virtual btSoftBodyWorldInfo& info() = 0;
  // Sets materials, margin and collision flags as the scenes of the two worlds have them.
  void add(std::unique_ptr<btSoftBody> body, int group = btBroadphaseProxy::DefaultFilter,
           int mask = btBroadphaseProxy::AllFilter);
  std::unique_ptr<btSoftBody> remove(btSoftBody* body);
  // A body that never moves.
  virtual void add_static(std::unique_ptr<btCollisionShape> shape, const btTransform& pose) = 0;

  virtual void step() = 0;  // options().dt

  const std::vector<std::unique_ptr<btSoftBody>>& bodies() const { return bodies_; }

  // All null or empty with Collisions::bullet.
  virtual const bullet::StepStats* step_stats() const = 0;
  virtual const bullet::StepStats* total_stats() const = 0;
  virtual Span<const bullet::StepContact> contacts() const = 0;
  virtual std::string status() const = 0;

 protected:
  explicit PhysicsWorld(const WorldOptions& options) : options_(options) {}

 private:
  virtual void enter(btSoftBody* body, int group, int mask) = 0;
  virtual void leave(btSoftBody* body) = 0;

  WorldOptions options_;
  std::vector<std::unique_ptr<btSoftBody>> bodies_;
};

}  // namespace lazyccd::scenes
