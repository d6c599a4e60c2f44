// Twin: the same scene in one of Bullet's worlds twice, with Bullet's own solver and with
// LazyCCD's.
#pragma once

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <cstring>
#include <functional>
#include <memory>
#include <vector>

#include "lazyccd/bullet/deformable_body_solver.h"
#include "lazyccd/bullet/soft_body_solver.h"
#include "support/catch.h"

namespace lazyccd::test {

inline bullet::SolverOptions with_threads(int threads) {
  bullet::SolverOptions options;
  options.detector.threads = threads;
  options.detector.backend = Backend::cpu;
  return options;
}

/// What both kinds of world below have.
struct TwinWorld {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  std::vector<std::unique_ptr<btSoftBody>> bodies;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> rigid_bodies;
  std::vector<std::unique_ptr<btDeformableLagrangianForce>> forces;

  bool compares_q = true;

  virtual ~TwinWorld() = default;
  virtual btDiscreteDynamicsWorld& world() = 0;
  virtual btSoftBodyWorldInfo& info() = 0;

  btRigidBody* add_rigid(std::unique_ptr<btCollisionShape> shape, const btVector3& at,
                         btScalar mass) {
    btVector3 inertia(0, 0, 0);
    shape->calculateLocalInertia(mass, inertia);
    rigid_bodies.push_back(std::make_unique<btRigidBody>(mass, nullptr, shape.get(), inertia));
    rigid_bodies.back()->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
    shapes.push_back(std::move(shape));
    world().addRigidBody(rigid_bodies.back().get());
    return rigid_bodies.back().get();
  }
  void remove_all() {
    for (const auto& body : bodies) world().removeCollisionObject(body.get());
    for (const auto& body : rigid_bodies) world().removeRigidBody(body.get());
  }
  void step(btScalar dt = btScalar(1) / 240) { world().stepSimulation(dt, 0, dt); }
};

/// A btSoftRigidDynamicsWorld with gravity.
struct RigidTwin : TwinWorld {
  btSequentialImpulseConstraintSolver constraints;
  btDefaultSoftBodySolver bullets;
  bullet::btLazySoftBodySolver lazy;
  btSoftRigidDynamicsWorld dynamics;

  explicit RigidTwin(int threads)  // 0: Bullet's solver
      : lazy(with_threads(threads > 0 ? threads : 1)),
        dynamics(&dispatcher, &broadphase, &constraints, &configuration,
                 threads > 0 ? static_cast<btSoftBodySolver*>(&lazy) : &bullets) {
    dynamics.setGravity(btVector3(0, -10, 0));
    info().m_gravity = btVector3(0, -10, 0);
  }
  ~RigidTwin() override { remove_all(); }
  btDiscreteDynamicsWorld& world() override { return dynamics; }
  btSoftBodyWorldInfo& info() override { return dynamics.getWorldInfo(); }
  btSoftBody* add(std::unique_ptr<btSoftBody> body) {
    body->m_cfg.collisions = btSoftBody::fCollision::SDF_RS | btSoftBody::fCollision::VF_SS;
    body->getCollisionShape()->setMargin(btScalar(0.01));
    dynamics.addSoftBody(body.get());
    bodies.push_back(std::move(body));
    return bodies.back().get();
  }
};

/// A btDeformableMultiBodyDynamicsWorld without forces.
struct DeformableTwin : TwinWorld {
  btDeformableMultiBodyConstraintSolver constraints;
  btDeformableBodySolver bullets;
  bullet::btLazyDeformableBodySolver lazy;
  std::unique_ptr<btDeformableMultiBodyDynamicsWorld> dynamics;

  explicit DeformableTwin(int threads) : lazy(with_threads(threads > 0 ? threads : 1)) {
    compares_q = false;  // LazyCCD sets it to m_x at anchors too
    btDeformableBodySolver* const solver = threads > 0 ? &lazy : &bullets;
    constraints.setDeformableSolver(solver);
    dynamics = std::make_unique<btDeformableMultiBodyDynamicsWorld>(
        &dispatcher, &broadphase, &constraints, &configuration, solver);
  }
  ~DeformableTwin() override { remove_all(); }
  btDiscreteDynamicsWorld& world() override { return *dynamics; }
  btSoftBodyWorldInfo& info() override { return dynamics->getWorldInfo(); }
  btSoftBody* add(std::unique_ptr<btSoftBody> body) {
    using Flag = btSoftBody::fCollision;
    body->m_cfg.collisions = Flag::SDF_RD | Flag::SDF_RDN | Flag::VF_DD;
    body->getCollisionShape()->setMargin(btScalar(0.01));
    body->m_sleepingThreshold = 0;
    dynamics->addSoftBody(body.get());
    bodies.push_back(std::move(body));
    return bodies.back().get();
  }
  /// The bodies of a force must be removed before the force is deleted.
  template <class Force>
  Force* make(std::unique_ptr<Force> force, const std::vector<btSoftBody*>& acts_on) {
    Force* const made = force.get();
    forces.push_back(std::move(force));
    for (btSoftBody* body : acts_on) dynamics->addForce(body, made);
    return made;
  }
};

/// Everything of the bodies that a step computes, and what it is.
struct TwinState {
  std::vector<btScalar> values;
  std::vector<const char*> names;

  void add(const char* name, btScalar value) {
    values.push_back(value);
    names.push_back(name);
  }
  void add(const char* name, const btVector3& value) {
    for (int k = 0; k < 3; ++k) add(name, value[k]);
  }

  explicit TwinState(const TwinWorld& world) {
    for (const auto& body : world.bodies) {
      for (int i = 0; i < body->m_nodes.size(); ++i) {
        const btSoftBody::Node& node = body->m_nodes[i];
        add("m_x", node.m_x);
        if (world.compares_q) add("m_q", node.m_q);
        add("m_v", node.m_v);
        add("m_n", node.m_n);
        add("m_f", node.m_f);
      }
      for (int i = 0; i < body->m_faces.size(); ++i) add("m_normal", body->m_faces[i].m_normal);
      for (int i = 0; i < body->m_tetras.size(); ++i)
        for (int k = 0; k < 3; ++k) add("m_F", body->m_tetras[i].m_F[k]);
      for (const btVector3& bound : body->m_bounds) add("m_bounds", bound);
      add("m_maxSpeedSquared", body->m_maxSpeedSquared);
      add("state", static_cast<btScalar>(body->getActivationState()));
    }
    for (const auto& body : world.rigid_bodies) {
      add("place", body->getWorldTransform().getOrigin());
      add("velocity", body->getLinearVelocity());
    }
  }
};

/// Steps both worlds. Both must have the same state after each step; zeros may differ in sign.
inline void check_steps(TwinWorld& a, TwinWorld& b, int steps,
                        const std::function<void(TwinWorld&, int step)>& before = {}) {
  for (int step = 0; step < steps; ++step) {
    CAPTURE(step);
    for (TwinWorld* world : {&a, &b}) {
      if (before) before(*world, step);
      world->step();
    }
    const TwinState expected(a), found(b);
    REQUIRE(expected.values.size() == found.values.size());
    std::size_t different = 0;
    for (std::size_t i = found.values.size(); i-- > 0;) {
      if (found.values[i] == expected.values[i]) continue;
      ++different;
      INFO("value " << i << " " << found.names[i] << ": " << expected.values[i] << ", "
                    << found.values[i]);
      if (different == 1) CHECK(found.values[i] == expected.values[i]);
    }
    REQUIRE(different == 0);
  }
}

}  // namespace lazyccd::test
