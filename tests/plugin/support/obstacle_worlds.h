// ObstacleWorld: small worlds with rigid bodies of all kinds, for tests of obstacles.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "lazyccd/bullet/deformable_body_solver.h"
#include "lazyccd/bullet/deformable_world.h"
#include "lazyccd/bullet/soft_body_solver.h"
#include "scenes/meshes/cloth.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::test {

/// One of Bullet's two worlds with LazyCCD. Owns all bodies that are added. Multibodies may be
/// added to the deformable world, and to the rigid world if it is made for them.
class ObstacleWorld {
  static bullet::SolverOptions measuring(bullet::SolverOptions options) {
    options.measure_energy = true;
    return options;
  }

 public:
  ObstacleWorld(scenes::World kind, double gravity, const bullet::SolverOptions& options = {},
                bool with_multibodies = false)
      : soft_(measuring(options)), deformable_(measuring(options)), springs_(2, btScalar(0.2)) {
    const btVector3 weight(0, static_cast<btScalar>(-gravity), 0);
    weight_ = std::make_unique<btDeformableGravityForce>(weight);
    if (kind == scenes::World::rigid && with_multibodies) {
      auto world = std::make_unique<btSoftMultiBodyDynamicsWorld>(
          &dispatcher_, &broadphase_, &multibody_solver_, &configuration_, &soft_);
      info_ = &world->getWorldInfo();
      soft_multibody_world_ = world.get();
      world_ = std::move(world);
    } else if (kind == scenes::World::rigid) {
      auto world = std::make_unique<btSoftRigidDynamicsWorld>(&dispatcher_, &broadphase_, &solver_,
                                                              &configuration_, &soft_);
      info_ = &world->getWorldInfo();
      soft_world_ = world.get();
      world_ = std::move(world);
    } else {
      constraints_.setDeformableSolver(&deformable_);
      auto world = std::make_unique<bullet::btLazyDeformableMultiBodyDynamicsWorld>(
          &dispatcher_, &broadphase_, &constraints_, &configuration_, &deformable_);
      info_ = &world->getWorldInfo();
      deformable_world_ = world.get();
      world_ = std::move(world);
    }
    world_->setGravity(weight);
    info_->m_gravity = weight;
    info_->air_density = 0;
  }
  ~ObstacleWorld() {
    for (const auto& body : soft_bodies_) world_->removeCollisionObject(body.get());
    for (const auto& body : rigid_bodies_) world_->removeRigidBody(body.get());
  }

  btSoftBodyWorldInfo& info() { return *info_; }
  btDiscreteDynamicsWorld& world() { return *world_; }
  bool is_rigid() const { return deformable_world_ == nullptr; }

  /// Adds a soft body that collides with soft and rigid bodies and never sleeps.
  btSoftBody* add(std::unique_ptr<btSoftBody> body, double margin = 0.01) {
    using Flag = btSoftBody::fCollision;
    btSoftBody* added = body.get();
    added->getCollisionShape()->setMargin(static_cast<btScalar>(margin));
    added->setActivationState(DISABLE_DEACTIVATION);
    if (is_rigid()) {
      added->m_materials[0]->m_kLST = btScalar(0.9);
      added->m_cfg.piterations = 10;
      added->m_cfg.collisions = Flag::SDF_RS | Flag::VF_SS;
      soft_world_ ? soft_world_->addSoftBody(added) : soft_multibody_world_->addSoftBody(added);
    } else {
      added->m_cfg.collisions = Flag::SDF_RD | Flag::SDF_RDN | Flag::VF_DD;
      added->m_cfg.kKHR = added->m_cfg.kCHR = 1;
      added->m_sleepingThreshold = 0;
      deformable_world_->addSoftBody(added);
      deformable_world_->addForce(added, &springs_);
      deformable_world_->addForce(added, weight_.get());
    }
    soft_bodies_.push_back(std::move(body));
    return added;
  }

  /// Adds a square sheet of `nodes` x `nodes` nodes with jitter, which moves down.
  btSoftBody* add_sheet(int nodes, double width, double height, double speed_down) {
    std::mt19937 random(7);
    scenes::Sheet sheet{nodes, nodes, width, width};
    sheet.height = height;
    sheet.angle = 0.3;
    sheet.jitter = 0.002;
    btSoftBody* body = add(scenes::make_sheet(info(), sheet, random));
    body->setVelocity(btVector3(0, static_cast<btScalar>(-speed_down), 0));
    return body;
  }

  btRigidBody* add(std::unique_ptr<btCollisionShape> shape, const btVector3& at, double mass = 0,
                   double margin = 0.01) {
    shape->setMargin(static_cast<btScalar>(margin));
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(static_cast<btScalar>(mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(static_cast<btScalar>(mass), nullptr, shape.get(),
                                                  inertia);
    info.m_startWorldTransform = btTransform(btQuaternion::getIdentity(), at);
    rigid_bodies_.push_back(std::make_unique<btRigidBody>(info));
    shapes_.push_back(std::move(shape));
    world_->addRigidBody(rigid_bodies_.back().get());
    return rigid_bodies_.back().get();
  }

  /// Tells the solver that the application has put a body elsewhere.
  void teleported(const btCollisionObject& body) {
    is_rigid() ? soft_.teleported(body) : deformable_.teleported(body);
  }

  /// Lets the motors of multibodies hold their joints against contacts, or not.
  void use_motors(bool use = true) {
    auto* const multibodies = use ? static_cast<btMultiBodyDynamicsWorld*>(world_.get()) : nullptr;
    is_rigid() ? soft_.use_motors_of(multibodies) : deformable_.use_motors_of(multibodies);
  }

  /// Removes the body from the world and deletes it.
  void remove(btCollisionObject* body) {
    world_->removeCollisionObject(body);
    const auto is_it = [body](const auto& other) { return other.get() == body; };
    soft_bodies_.erase(std::remove_if(soft_bodies_.begin(), soft_bodies_.end(), is_it),
                       soft_bodies_.end());
    rigid_bodies_.erase(std::remove_if(rigid_bodies_.begin(), rigid_bodies_.end(), is_it),
                        rigid_bodies_.end());
  }

  static void make_kinematic(btRigidBody& body) {
    body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    body.setActivationState(DISABLE_DEACTIVATION);
  }

  /// Runs `count` steps of `dt` seconds. Calls `before` with the step's number before each.
  void steps(int count, double dt = 1.0 / 240, const std::function<void(int)>& before = {}) {
    for (int i = 0; i < count; ++i) {
      if (before) before(i);
      world_->stepSimulation(static_cast<btScalar>(dt), 0, static_cast<btScalar>(dt));
    }
  }

  const bullet::StepStats& total() const {
    return is_rigid() ? soft_.total_stats() : deformable_.total_stats();
  }
  const bullet::StepStats& last() const {
    return is_rigid() ? soft_.step_stats() : deformable_.step_stats();
  }
  Span<const bullet::StepContact> contacts() const {
    return is_rigid() ? soft_.contacts() : deformable_.contacts();
  }
  void debug_draw(btIDebugDraw& drawer, const bullet::DebugDrawOptions& options) const {
    is_rigid() ? soft_.debug_draw(drawer, options) : deformable_.debug_draw(drawer, options);
  }
  std::string status() const { return is_rigid() ? soft_.status() : deformable_.status(); }
  std::vector<bullet::ExcludedBody> excluded_bodies() const {
    return is_rigid() ? soft_.excluded_bodies() : deformable_.excluded_bodies();
  }

 private:
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btMultiBodyConstraintSolver multibody_solver_;
  btDeformableMultiBodyConstraintSolver constraints_;
  bullet::btLazySoftBodySolver soft_;
  bullet::btLazyDeformableBodySolver deformable_;
  btDeformableMassSpringForce springs_;
  std::unique_ptr<btDeformableGravityForce> weight_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
  btSoftRigidDynamicsWorld* soft_world_ = nullptr;
  btSoftMultiBodyDynamicsWorld* soft_multibody_world_ = nullptr;
  btDeformableMultiBodyDynamicsWorld* deformable_world_ = nullptr;
  btSoftBodyWorldInfo* info_ = nullptr;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btSoftBody>> soft_bodies_;
  std::vector<std::unique_ptr<btRigidBody>> rigid_bodies_;
};

/// The triangles of a flat square of `quads` x `quads` quads in the plane y = 0, centred at the
/// origin.
inline std::unique_ptr<btTriangleMesh> flat_triangles(int quads, double width) {
  auto mesh = std::make_unique<btTriangleMesh>();
  const auto point = [&](int i, int j) {
    return btVector3(static_cast<btScalar>((i / double(quads) - 0.5) * width), 0,
                     static_cast<btScalar>((j / double(quads) - 0.5) * width));
  };
  for (int i = 0; i < quads; ++i) {
    for (int j = 0; j < quads; ++j) {
      mesh->addTriangle(point(i, j), point(i, j + 1), point(i + 1, j + 1));
      mesh->addTriangle(point(i, j), point(i + 1, j + 1), point(i + 1, j));
    }
  }
  return mesh;
}

/// The triangles of a cube around the origin; `half`: half of its side, metres.
inline std::unique_ptr<btTriangleMesh> box_triangles(double half) {
  auto mesh = std::make_unique<btTriangleMesh>();
  const auto r = static_cast<btScalar>(half);
  for (int axis = 0; axis < 3; ++axis) {
    for (const btScalar side : {r, -r}) {
      const auto corner = [&](btScalar u, btScalar v) {
        btVector3 x(0, 0, 0);
        x[axis] = side;
        x[(axis + 1) % 3] = side > 0 ? u : v;
        x[(axis + 2) % 3] = side > 0 ? v : u;
        return x;
      };
      mesh->addTriangle(corner(-r, -r), corner(r, -r), corner(r, r));
      mesh->addTriangle(corner(-r, -r), corner(r, r), corner(-r, r));
    }
  }
  return mesh;
}

}  // namespace lazyccd::test
