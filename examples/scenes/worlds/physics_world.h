// A Bullet world of either kind, with LazyCCD or with Bullet's own soft body collisions.
#pragma once

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btSoftBody.h>
#include <LinearMath/btMotionState.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "scenes/meshes/tessellation.h"

namespace lazyccd::scenes {

enum class World {
  rigid,
  deformable
};  // btSoftRigidDynamicsWorld, btDeformableMultiBodyDynamicsWorld
enum class Collisions {
  lazyccd,
  bullet,
  mended_bullet  // as in mended_bullet.h
};               // whose

struct WorldOptions {
  World world = World::deformable;
  Collisions collisions = Collisions::lazyccd;
  double dt = 1.0 / 240;  // s
  double gravity = 0;     // m/s^2, downwards (-y)
  double margin = 0.01;   // m, of every body
  // With LazyCCD in the deformable world: Bullet's own world class, its passes over soft pairs
  // included.
  bool stock_world = false;
  bullet::SolverOptions lazyccd;
};

// A rigid body with its surface in its own frame.
struct RigidBody {
  std::unique_ptr<btCollisionShape> shape;
  std::unique_ptr<btRigidBody> body;
  Triangles surface;

  // A sheet of triangles, not a solid.
  bool is_mesh() const { return shape->isConcave(); }
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
  void add_static(std::unique_ptr<btCollisionShape> shape, const btTransform& pose);
  // A body that is where `path` says at each time, in seconds.
  void add_moving(std::unique_ptr<btCollisionShape> shape,
                  std::function<btTransform(double time)> path);
  btRigidBody& add_dynamic(std::unique_ptr<btCollisionShape> shape, const btTransform& pose,
                           double mass);
  // Called before each step with the time at its end, to set velocities of pinned nodes.
  void drive(std::function<void(double time)> driver) { drivers_.push_back(std::move(driver)); }

  void step();  // options().dt
  double time() const { return steps_ * options_.dt; }

  const std::vector<std::unique_ptr<btSoftBody>>& bodies() const { return bodies_; }
  const std::vector<RigidBody>& rigid_bodies() const { return rigid_bodies_; }

  // All null or empty without LazyCCD.
  virtual const bullet::StepStats* step_stats() const = 0;
  virtual const bullet::StepStats* total_stats() const = 0;
  virtual Span<const bullet::StepContact> contacts() const = 0;
  virtual std::string status() const = 0;

 protected:
  explicit PhysicsWorld(const WorldOptions& options) : options_(options) {}

  virtual btDiscreteDynamicsWorld& dynamics() = 0;

 private:
  virtual void enter(btSoftBody* body, int group, int mask) = 0;
  virtual void leave(btSoftBody* body) = 0;
  btRigidBody& add_rigid(std::unique_ptr<btCollisionShape> shape, const btTransform& pose,
                         double mass);

  WorldOptions options_;
  std::int64_t steps_ = 0;
  std::vector<std::unique_ptr<btSoftBody>> bodies_;
  std::vector<RigidBody> rigid_bodies_;
  std::vector<std::unique_ptr<btMotionState>> motions_;
  std::vector<std::function<void(double time)>> drivers_;
};

}  // namespace lazyccd::scenes
