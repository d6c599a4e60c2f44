// A collision algorithm for pairs of soft bodies in Bullet's dispatcher. The solvers do not need
// it, because Bullet's own algorithm hands them the pairs. It is for applications that choose
// collision algorithms themselves:
//
//   btLazySoftBodyCollisionConfiguration configuration(solver);
//
// or, for an existing dispatcher:
//
//   btLazySoftSoftCollisionAlgorithm::CreateFunc create(solver);
//   register_soft_soft(dispatcher, create);
#pragma once

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>

#include "lazyccd/bullet/pair_handler.h"
#include "lazyccd/export.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Hands its pair to the handler and does no detection.
class LAZYCCD_BULLET_API btLazySoftSoftCollisionAlgorithm : public btCollisionAlgorithm {
 public:
  btLazySoftSoftCollisionAlgorithm(PairHandler& handler,
                                   const btCollisionAlgorithmConstructionInfo& ci)
      : btCollisionAlgorithm(ci), handler_(handler) {}

  void processCollision(const btCollisionObjectWrapper* body0Wrap,
                        const btCollisionObjectWrapper* body1Wrap,
                        const btDispatcherInfo& dispatchInfo, btManifoldResult* resultOut) override;
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray&) override {}

  /// Creates the algorithm for a dispatcher. The handler must outlive the dispatcher.
  struct CreateFunc : btCollisionAlgorithmCreateFunc {
    explicit CreateFunc(PairHandler& pair_handler) : handler(pair_handler) {}
    btCollisionAlgorithm* CreateCollisionAlgorithm(
        btCollisionAlgorithmConstructionInfo& ci, const btCollisionObjectWrapper* body0Wrap,
        const btCollisionObjectWrapper* body1Wrap) override;
    PairHandler& handler;
  };

 private:
  PairHandler& handler_;
};

/// Bullet's configuration for soft and rigid bodies, with LazyCCD's algorithm for soft-soft pairs.
/// The handler must outlive the configuration.
class LAZYCCD_BULLET_API btLazySoftBodyCollisionConfiguration
    : public btSoftBodyRigidBodyCollisionConfiguration {
 public:
  explicit btLazySoftBodyCollisionConfiguration(
      PairHandler& handler,
      const btDefaultCollisionConstructionInfo& info = btDefaultCollisionConstructionInfo())
      : btSoftBodyRigidBodyCollisionConfiguration(info), create_(handler) {}

  btCollisionAlgorithmCreateFunc* getCollisionAlgorithmCreateFunc(int proxyType0,
                                                                  int proxyType1) override;

 private:
  btLazySoftSoftCollisionAlgorithm::CreateFunc create_;
};

/// Registers the algorithm for soft-soft pairs. `create` must outlive the dispatcher.
void register_soft_soft(btCollisionDispatcher& dispatcher,
                        btLazySoftSoftCollisionAlgorithm::CreateFunc& create);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
