// btDeformableMultiBodyDynamicsWorld without its own passes over pairs of soft bodies: the discrete
// one, the repulsion that acts on it, and the continuous one, whose contacts nothing reads (up to
// five times a step). The rest of the step is Bullet's, call by call.
#pragma once

#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>

#include "lazyccd/bullet/deformable_body_solver.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class btLazyDeformableMultiBodyDynamicsWorld : public btDeformableMultiBodyDynamicsWorld {
 public:
  btLazyDeformableMultiBodyDynamicsWorld(btDispatcher* dispatcher, btBroadphaseInterface* pairCache,
                                         btDeformableMultiBodyConstraintSolver* constraintSolver,
                                         btCollisionConfiguration* collisionConfiguration,
                                         btLazyDeformableBodySolver* deformableBodySolver);

 protected:
  void internalSingleStepSimulation(btScalar timeStep) override;

 private:
  const btLazyDeformableBodySolver* lazy_solver_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
