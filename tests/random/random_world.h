// RandomWorld: one of Bullet's worlds with soft bodies. Its class and its parts are random.
#pragma once

#include <BulletDynamics/Dynamics/btDiscreteDynamicsWorld.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include <memory>
#include <string>
#include <vector>

#include "lazyccd/bullet/deformable_body_solver.h"
#include "lazyccd/bullet/soft_body_solver.h"
#include "random/random_source.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::test {

/// Owns the world and everything it needs, but not the bodies. Bodies must be removed first.
class RandomWorld {
 public:
  RandomWorld(scenes::World kind, scenes::Collisions collisions,
              const bullet::SolverOptions& options, RandomSource& random);

  const std::string& name() const { return name_; }
  bool is_rigid() const { return kind_ == scenes::World::rigid; }
  btDiscreteDynamicsWorld& bullets() { return *world_; }
  btSoftBodyWorldInfo& info() { return *info_; }
  const btVector3& gravity() const { return gravity_; }
  void set_gravity(const btVector3& gravity);

  /// Adds the body to a collision layer, 0 to 2. By default all layers collide with each other;
  /// in some worlds random pairs of layers do not.
  void add(btSoftBody& body, int layer);
  void remove(btSoftBody& body);
  void add(btRigidBody& body, int layer);
  /// Adds a force and keeps it. Only for the deformable world.
  void add_force(btSoftBody& body, std::unique_ptr<btDeformableLagrangianForce> force);

  /// Says that the body was put elsewhere: LazyCCD sweeps nothing from its old place.
  void teleported(const btRigidBody& body);
  const bullet::StepStats& step_stats() const;
  const bullet::StepStats& total_stats() const;
  /// Whether the last step left a body out, because it is lost.
  bool has_left_out() const;
  std::string status() const;

 private:
  static constexpr int layers = 3;
  int mask_of(int layer) const;

  scenes::World kind_;
  std::string name_;
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  std::unique_ptr<btBroadphaseInterface> broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btMultiBodyConstraintSolver multi_body_solver_;
  btDeformableMultiBodyConstraintSolver constraints_;
  bullet::btLazySoftBodySolver soft_solver_;
  bullet::btLazyDeformableBodySolver deformable_solver_;
  btDeformableBodySolver bullets_solver_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
  btSoftBodyWorldInfo* info_ = nullptr;
  btVector3 gravity_ = btVector3(0, 0, 0);
  bool meets_[layers][layers];
  std::vector<std::unique_ptr<btDeformableLagrangianForce>> forces_;
};

}  // namespace lazyccd::test
