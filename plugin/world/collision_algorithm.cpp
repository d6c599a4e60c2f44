#include "lazyccd/bullet/collision_algorithm.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>

#include <new>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

btSoftBody* soft_body(const btCollisionObjectWrapper* wrap) {
  return const_cast<btSoftBody*>(btSoftBody::upcast(wrap->getCollisionObject()));
}

}  // namespace

void btLazySoftSoftCollisionAlgorithm::processCollision(const btCollisionObjectWrapper* body0Wrap,
                                                        const btCollisionObjectWrapper* body1Wrap,
                                                        const btDispatcherInfo&,
                                                        btManifoldResult*) {
  handler_.handle_pair(soft_body(body0Wrap), soft_body(body1Wrap));
}

btCollisionAlgorithm* btLazySoftSoftCollisionAlgorithm::CreateFunc::CreateCollisionAlgorithm(
    btCollisionAlgorithmConstructionInfo& ci, const btCollisionObjectWrapper*,
    const btCollisionObjectWrapper*) {
  void* memory =
      ci.m_dispatcher1->allocateCollisionAlgorithm(sizeof(btLazySoftSoftCollisionAlgorithm));
  return new (memory) btLazySoftSoftCollisionAlgorithm(handler, ci);
}

btCollisionAlgorithmCreateFunc*
btLazySoftBodyCollisionConfiguration::getCollisionAlgorithmCreateFunc(int proxyType0,
                                                                      int proxyType1) {
  if (proxyType0 == SOFTBODY_SHAPE_PROXYTYPE && proxyType1 == SOFTBODY_SHAPE_PROXYTYPE)
    return &create_;
  return btSoftBodyRigidBodyCollisionConfiguration::getCollisionAlgorithmCreateFunc(proxyType0,
                                                                                    proxyType1);
}

void register_soft_soft(btCollisionDispatcher& dispatcher,
                        btLazySoftSoftCollisionAlgorithm::CreateFunc& create) {
  dispatcher.registerCollisionCreateFunc(SOFTBODY_SHAPE_PROXYTYPE, SOFTBODY_SHAPE_PROXYTYPE,
                                         &create);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
