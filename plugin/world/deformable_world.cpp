#include "lazyccd/bullet/deformable_world.h"

#include <LinearMath/btQuickprof.h>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

btLazyDeformableMultiBodyDynamicsWorld::btLazyDeformableMultiBodyDynamicsWorld(
    btDispatcher* dispatcher, btBroadphaseInterface* pairCache,
    btDeformableMultiBodyConstraintSolver* constraintSolver,
    btCollisionConfiguration* collisionConfiguration,
    btLazyDeformableBodySolver* deformableBodySolver)
    : btDeformableMultiBodyDynamicsWorld(dispatcher, pairCache, constraintSolver,
                                         collisionConfiguration, deformableBodySolver),
      lazy_solver_(deformableBodySolver) {}

void btLazyDeformableMultiBodyDynamicsWorld::internalSingleStepSimulation(btScalar timeStep) {
  if (!lazy_solver_->is_active()) {
    btDeformableMultiBodyDynamicsWorld::internalSingleStepSimulation(timeStep);
    return;
  }
  BT_PROFILE("internalSingleStepSimulation");
  if (m_internalPreTickCallback) (*m_internalPreTickCallback)(this, timeStep);
  reinitialize(timeStep);
  applyRigidBodyGravity(timeStep);
  predictUnconstraintMotion(timeStep);
  btMultiBodyDynamicsWorld::performDiscreteCollisionDetection();
  btMultiBodyDynamicsWorld::calculateSimulationIslands();
  beforeSolverCallbacks(timeStep);
  solveConstraints(timeStep);
  afterSolverCallbacks(timeStep);
  // The base class calls performDeformableCollisionDetection(), applyRepulsionForce() and
  // performGeometricCollisions() at this point. LazyCCD does this work in applyTransforms(), which
  // the next call runs.
  integrateTransforms(timeStep);
  btMultiBodyDynamicsWorld::updateActions(timeStep);
  updateActivationState(timeStep);
}

void btLazyDeformableMultiBodyDynamicsWorld::updateActivationState(btScalar timeStep) {
  if (!lazy_solver_->skips_any()) {
    btDeformableMultiBodyDynamicsWorld::updateActivationState(timeStep);
    return;
  }
  // The base class clears the velocities of sleeping bodies. Those that are skipped have none.
  btSoftBodyArray& bodies = getSoftBodyArray();
  const btSoftBodyArray all(bodies);
  btSoftBodyArray others;
  for (int i = 0; i < all.size(); ++i)
    if (!lazy_solver_->skips(*all[i]) || all[i]->isActive() || !all[i]->wantsSleeping())
      others.push_back(all[i]);
  bodies.copyFromArray(others);
  btDeformableMultiBodyDynamicsWorld::updateActivationState(timeStep);
  bodies.copyFromArray(all);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
