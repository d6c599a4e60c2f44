#include "scenes/worlds/physics_world.h"

#include <LinearMath/btDefaultMotionState.h>

#include <algorithm>

#include "scenes/worlds/world_with.h"

namespace lazyccd::scenes {

std::unique_ptr<PhysicsWorld> PhysicsWorld::make(const WorldOptions& options) {
  return options.world == World::rigid ? make_rigid_world(options) : make_deformable_world(options);
}

void PhysicsWorld::add(std::unique_ptr<btSoftBody> body, int group, int mask) {
  body->getCollisionShape()->setMargin(static_cast<btScalar>(options_.margin));
  body->setActivationState(DISABLE_DEACTIVATION);
  bodies_.push_back(std::move(body));
  enter(bodies_.back().get(), group, mask);
}

std::unique_ptr<btSoftBody> PhysicsWorld::remove(btSoftBody* body) {
  leave(body);
  const auto at = std::find_if(bodies_.begin(), bodies_.end(),
                               [body](const auto& owned) { return owned.get() == body; });
  std::unique_ptr<btSoftBody> result = std::move(*at);
  bodies_.erase(at);
  return result;
}

btRigidBody& PhysicsWorld::add_rigid(std::unique_ptr<btCollisionShape> shape,
                                     const btTransform& pose, double mass) {
  shape->setMargin(static_cast<btScalar>(options_.margin));
  btVector3 inertia(0, 0, 0);
  if (mass > 0) shape->calculateLocalInertia(static_cast<btScalar>(mass), inertia);
  btRigidBody::btRigidBodyConstructionInfo info(static_cast<btScalar>(mass), nullptr, shape.get(),
                                                inertia);
  info.m_startWorldTransform = pose;
  RigidBody rigid;
  rigid.body = std::make_unique<btRigidBody>(info);
  rigid.body->setFriction(btScalar(0.5));
  rigid.surface = tessellate(*shape);
  rigid.shape = std::move(shape);
  rigid_bodies_.push_back(std::move(rigid));
  return *rigid_bodies_.back().body;
}

void PhysicsWorld::add_static(std::unique_ptr<btCollisionShape> shape, const btTransform& pose) {
  dynamics().addRigidBody(&add_rigid(std::move(shape), pose, 0));
}

btRigidBody& PhysicsWorld::add_dynamic(std::unique_ptr<btCollisionShape> shape,
                                       const btTransform& pose, double mass) {
  btRigidBody& body = add_rigid(std::move(shape), pose, mass);
  body.setActivationState(DISABLE_DEACTIVATION);
  dynamics().addRigidBody(&body);
  return body;
}

void PhysicsWorld::add_moving(std::unique_ptr<btCollisionShape> shape,
                              std::function<btTransform(double time)> path) {
  btRigidBody& body = add_rigid(std::move(shape), path(0), 0);
  body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  body.setActivationState(DISABLE_DEACTIVATION);
  motions_.push_back(std::make_unique<btDefaultMotionState>(path(0)));
  body.setMotionState(motions_.back().get());
  dynamics().addRigidBody(&body);
  drive([motion = motions_.back().get(), path = std::move(path)](double time) {
    motion->setWorldTransform(path(time));
  });
}

void PhysicsWorld::step() {
  ++steps_;
  for (const auto& driver : drivers_) driver(time());
  const btScalar dt = static_cast<btScalar>(options_.dt);
  dynamics().stepSimulation(dt, 0, dt);
}

}  // namespace lazyccd::scenes
