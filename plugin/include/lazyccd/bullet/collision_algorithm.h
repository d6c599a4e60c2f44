// Pairs of soft bodies in Bullet's dispatcher. The solvers need none of this: Bullet's own algorithm
// brings them the pairs. It is for applications that choose collision algorithms themselves:
//
//   btLazySoftBodyCollisionConfiguration configuration(solver);
//
// or, for a dispatcher that is there already,
//
//   btLazySoftSoftCollisionAlgorithm::CreateFunc create(solver);
//   register_soft_soft(dispatcher, create);
#pragma once

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include "lazyccd/bullet/pair_handler.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Queues its pair and does no work.
class btLazySoftSoftCollisionAlgorithm : public btCollisionAlgorithm {
 public:
  btLazySoftSoftCollisionAlgorithm(PairHandler& queue, const btCollisionAlgorithmConstructionInfo& ci)
      : btCollisionAlgorithm(ci), queue_(queue) {}

  void processCollision(const btCollisionObjectWrapper* body0Wrap,
                        const btCollisionObjectWrapper* body1Wrap,
                        const btDispatcherInfo& dispatchInfo, btManifoldResult* resultOut) override;
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray&) override {}

  // The queue must outlive the dispatcher's use of it.
  struct CreateFunc : btCollisionAlgorithmCreateFunc {
    explicit CreateFunc(PairHandler& pairs) : queue(pairs) {}
    btCollisionAlgorithm* CreateCollisionAlgorithm(
        btCollisionAlgorithmConstructionInfo& ci, const btCollisionObjectWrapper* body0Wrap,
        const btCollisionObjectWrapper* body1Wrap) override;
    PairHandler& queue;
  };

 private:
  PairHandler& queue_;
};

// Bullet's configuration for soft and rigid bodies, with LazyCCD's algorithm for soft pairs.
class btLazySoftBodyCollisionConfiguration : public btSoftBodyRigidBodyCollisionConfiguration {
 public:
  explicit btLazySoftBodyCollisionConfiguration(
      PairHandler& queue,
      const btDefaultCollisionConstructionInfo& info = btDefaultCollisionConstructionInfo())
      : btSoftBodyRigidBodyCollisionConfiguration(info), create_(queue) {}

  btCollisionAlgorithmCreateFunc* getCollisionAlgorithmCreateFunc(int proxyType0,
                                                                  int proxyType1) override;

 private:
  btLazySoftSoftCollisionAlgorithm::CreateFunc create_;
};

// `create` must outlive the dispatcher.
void register_soft_soft(btCollisionDispatcher& dispatcher,
                        btLazySoftSoftCollisionAlgorithm::CreateFunc& create);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
