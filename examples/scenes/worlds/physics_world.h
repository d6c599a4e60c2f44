// A Bullet world of either kind, with LazyCCD or with Bullet's own soft-body collisions.
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
  rigid,      // btSoftRigidDynamicsWorld
  deformable  // btDeformableMultiBodyDynamicsWorld
};
/// What handles the collisions of soft bodies.
enum class Collisions {
  lazyccd,
  bullet,
  mended_bullet  // see mended_bullet.h
};

struct WorldOptions {
  World world = World::deformable;
  Collisions collisions = Collisions::lazyccd;
  double dt = 1.0 / 240;  // s
  double gravity = 0;     // m/s^2, downwards (-y)
  double margin = 0.01;   // m, of every body
  /// With LazyCCD in the deformable world: uses Bullet's own world class, which also runs Bullet's
  /// passes over pairs of soft bodies.
  bool stock_world = false;
  bullet::SolverOptions lazyccd;
};

/// A rigid body and its surface, in the frame of the body.
struct RigidBody {
  std::unique_ptr<btCollisionShape> shape;
  std::unique_ptr<btRigidBody> body;
  Triangles surface;

  /// Returns true for a triangle mesh without a volume.
  bool is_mesh() const { return shape->isConcave(); }
};

/// A world with its bodies, which it owns, and the motions of driven ones.
class PhysicsWorld {
 public:
  static std::unique_ptr<PhysicsWorld> make(const WorldOptions& options);
  virtual ~PhysicsWorld() = default;

  const WorldOptions& options() const { return options_; }

  virtual btSoftBodyWorldInfo& info() = 0;
  virtual btDiscreteDynamicsWorld& dynamics() = 0;
  /// Adds a soft body. Sets its materials, margin and collision flags as all scenes of that world
  /// have them.
  void add(std::unique_ptr<btSoftBody> body, int group = btBroadphaseProxy::DefaultFilter,
           int mask = btBroadphaseProxy::AllFilter);
  std::unique_ptr<btSoftBody> remove(btSoftBody* body);
  /// Adds a body that never moves.
  void add_static(std::unique_ptr<btCollisionShape> shape, const btTransform& pose);
  /// Adds a kinematic body. `path` gives its pose at a time in seconds.
  void add_moving(std::unique_ptr<btCollisionShape> shape,
                  std::function<btTransform(double time)> path);
  btRigidBody& add_dynamic(std::unique_ptr<btCollisionShape> shape, const btTransform& pose,
                           double mass);
  /// Registers a function that each step calls first, with the time at the end of the step. It sets
  /// the velocities of pinned nodes.
  void drive(std::function<void(double time)> driver) { drivers_.push_back(std::move(driver)); }

  void step();  // by options().dt
  double time() const { return steps_ * options_.dt; }

  const std::vector<std::unique_ptr<btSoftBody>>& bodies() const { return bodies_; }
  const std::vector<RigidBody>& rigid_bodies() const { return rigid_bodies_; }

  // These four return null or nothing without LazyCCD.
  virtual const bullet::StepStats* step_stats() const = 0;
  virtual const bullet::StepStats* total_stats() const = 0;
  virtual Span<const bullet::StepContact> contacts() const = 0;
  virtual std::string status() const = 0;

 protected:
  explicit PhysicsWorld(const WorldOptions& options) : options_(options) {}

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
