#include "scenes/behaviour/multibody.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <algorithm>

namespace lazyccd::scenes::behaviour {
namespace {

btVector3 inertia_of(const btVector3& size, btScalar mass) {
  const btVector3 s = size * size * (mass / 12);
  return btVector3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());
}

}  // namespace

Multibody::Multibody(const btVector3& place, const btVector3& base_size, double base_mass,
                     bool fixed_base, const std::vector<BoxLink>& links) {
  const btScalar heavy = static_cast<btScalar>(base_mass);
  body_ = std::make_unique<btMultiBody>(static_cast<int>(links.size()), heavy,
                                        inertia_of(base_size, heavy), fixed_base, false);
  body_->setBasePos(place);
  const btQuaternion same = btQuaternion::getIdentity();
  for (int i = 0; i < static_cast<int>(links.size()); ++i) {
    const BoxLink& link = links[i];
    const btScalar mass = static_cast<btScalar>(link.mass);
    const btVector3 inertia = inertia_of(link.size, mass);
    switch (link.joint) {
      case Joint::fixed:
        body_->setupFixed(i, mass, inertia, link.parent, same, link.pivot, link.centre);
        break;
      case Joint::revolute:
        body_->setupRevolute(i, mass, inertia, link.parent, same, link.axis, link.pivot,
                             link.centre, true);
        break;
      case Joint::prismatic:
        body_->setupPrismatic(i, mass, inertia, link.parent, same, link.axis, link.pivot,
                              link.centre, true);
        break;
    }
  }
  body_->finalizeMultiDof();
  body_->setHasSelfCollision(false);
  body_->setLinearDamping(0);
  body_->setAngularDamping(0);
  add_collider(-1, base_size);
  for (int i = 0; i < static_cast<int>(links.size()); ++i) add_collider(i, links[i].size);
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> places;
  body_->forwardKinematics(rotations, places);
  body_->updateCollisionObjectWorldTransforms(rotations, places);
}

Multibody::~Multibody() {
  if (!world_) return;
  for (const auto& motor : motors_) world_->removeMultiBodyConstraint(motor.get());
  for (const auto& collider : colliders_) world_->removeCollisionObject(collider.get());
  world_->removeMultiBody(body_.get());
}

void Multibody::add_collider(int link, const btVector3& size) {
  if (size.fuzzyZero()) return;
  shapes_.push_back(std::make_unique<btBoxShape>(size / 2));
  shapes_.back()->setMargin(btScalar(0.01));
  colliders_.push_back(std::make_unique<btMultiBodyLinkCollider>(body_.get(), link));
  colliders_.back()->setCollisionShape(shapes_.back().get());
  colliders_.back()->setFriction(1);
  if (link < 0) {
    body_->setBaseCollider(colliders_.back().get());
  } else {
    body_->getLink(link).m_collider = colliders_.back().get();
  }
}

btMultiBodyJointMotor* Multibody::add_motor(int link, double force, double step_seconds) {
  motors_.push_back(std::make_unique<btMultiBodyJointMotor>(
      body_.get(), link, 0, static_cast<btScalar>(force * step_seconds)));
  motors_.back()->finalizeMultiDof();
  if (world_) world_->addMultiBodyConstraint(motors_.back().get());
  return motors_.back().get();
}

void Multibody::add_to(btMultiBodyDynamicsWorld& world) {
  world_ = &world;
  world.addMultiBody(body_.get());
  for (const auto& collider : colliders_) {
    // Bullet's groups for what moves and what does not, so that fixed bases do not meet each other.
    const bool still = body_->hasFixedBase() && collider->m_link < 0;
    world.addCollisionObject(
        collider.get(), still ? btBroadphaseProxy::StaticFilter : btBroadphaseProxy::DefaultFilter,
        still ? btBroadphaseProxy::AllFilter ^ btBroadphaseProxy::StaticFilter
              : btBroadphaseProxy::AllFilter);
  }
  for (const auto& motor : motors_) world.addMultiBodyConstraint(motor.get());
}

double Multibody::kinetic_energy() const {
  // Bullet gives both velocities in the link's frame, and inertia there is diagonal.
  const int count = body_->getNumLinks() + 1;
  std::vector<btVector3> turning(count), speed(count);
  body_->compTreeLinkVelocities(turning.data(), speed.data());
  double energy = 0;
  for (int i = body_->hasFixedBase() ? 1 : 0; i < count; ++i) {
    const btScalar mass = i == 0 ? body_->getBaseMass() : body_->getLinkMass(i - 1);
    const btVector3& inertia = i == 0 ? body_->getBaseInertia() : body_->getLinkInertia(i - 1);
    energy +=
        0.5 * static_cast<double>(mass * speed[i].length2() + turning[i].dot(inertia * turning[i]));
  }
  return energy;
}

double Multibody::potential_energy(double gravity) const {
  double moment = static_cast<double>(body_->getBaseMass() * body_->getBasePos().y());
  for (int i = 0; i < body_->getNumLinks(); ++i) {
    const btVector3 centre = body_->localPosToWorld(i, btVector3(0, 0, 0));
    moment += static_cast<double>(body_->getLinkMass(i) * centre.y());
  }
  return gravity * moment;
}

double Multibody::fastest_link() const {
  const int count = body_->getNumLinks() + 1;
  std::vector<btVector3> turning(count), speed(count);
  body_->compTreeLinkVelocities(turning.data(), speed.data());
  btScalar fastest = 0;
  for (int i = body_->hasFixedBase() ? 1 : 0; i < count; ++i)
    fastest = std::max(fastest, speed[i].length());
  return static_cast<double>(fastest);
}

}  // namespace lazyccd::scenes::behaviour
