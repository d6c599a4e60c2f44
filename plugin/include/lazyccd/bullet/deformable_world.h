// A deformable world that skips Bullet's own passes over pairs of soft bodies.
#pragma once

#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>

#include "lazyccd/bullet/deformable_body_solver.h"
#include "lazyccd/export.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// btDeformableMultiBodyDynamicsWorld without three passes: the discrete detection of soft-soft
/// contacts, the repulsion that acts on them, and the continuous detection, whose contacts nothing
/// reads (up to five passes per step). The rest of the step is Bullet's, call by call. After a step
/// that ran without LazyCCD, the next step is Bullet's own with all passes.
class LAZYCCD_BULLET_API btLazyDeformableMultiBodyDynamicsWorld
    : public btDeformableMultiBodyDynamicsWorld {
 public:
  btLazyDeformableMultiBodyDynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* pairCache,
                                         btDeformableMultiBodyConstraintSolver* constraintSolver,
                                         btCollisionConfiguration* collisionConfiguration,
                                         btLazyDeformableBodySolver* deformableBodySolver);

 protected:
  void internalSingleStepSimulation(btScalar timeStep) override;
  void updateActivationState(btScalar timeStep) override;

 private:
  const btLazyDeformableBodySolver* lazy_solver_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
