#include "random/multibody_chain.h"

namespace lazyccd::test {

Chain::Chain(const btVector3& place, double length, double angular_velocity, RandomSource& random)
    : shape_(scalar(length) * btVector3(scalar(0.1), scalar(0.4), scalar(0.2))),
      surface_(scenes::tessellate(shape_)) {
  const int count = 1 + random.below(3);
  btVector3 inertia;
  shape_.calculateLocalInertia(1, inertia);
  body_ = std::make_unique<btMultiBody>(count, scalar(1), inertia, true, false);
  body_->setBasePos(place);
  const btVector3 half(0, scalar(-0.5 * length), 0);
  for (int i = 0; i < count; ++i) {
    body_->setupRevolute(i, 1, inertia, i - 1, btQuaternion::getIdentity(), random.direction(),
                         i == 0 ? btVector3(0, 0, 0) : half, half, true);
  }
  body_->finalizeMultiDof();
  for (int i = 0; i < count; ++i) {
    body_->setJointVel(i, scalar(angular_velocity * random.uniform(-1, 1)));
    links_.push_back(std::make_unique<btMultiBodyLinkCollider>(body_.get(), i));
    links_.back()->setCollisionShape(&shape_);
    body_->getLink(i).m_collider = links_.back().get();
  }
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> places;
  body_->forwardKinematics(rotations, places);
  body_->updateCollisionObjectWorldTransforms(rotations, places);
}

void Chain::add_to(btMultiBodyDynamicsWorld& world) {
  world_ = &world;
  world.addMultiBody(body_.get());
  for (const auto& link : links_) world.addCollisionObject(link.get());
}

void Chain::remove() {
  if (!world_) return;
  for (const auto& link : links_) world_->removeCollisionObject(link.get());
  world_->removeMultiBody(body_.get());
  world_ = nullptr;
}

}  // namespace lazyccd::test
