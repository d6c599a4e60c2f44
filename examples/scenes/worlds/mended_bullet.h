// Bullet alone, with what loses momentum or adds energy in its own contacts of soft bodies put
// right: a control that tells where LazyCCD's paths part from Bullet's, and why. It misses what
// Bullet misses.
#pragma once

#include <BulletSoftBody/btDefaultSoftBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>

namespace lazyccd::scenes {

// For btSoftRigidDynamicsWorld. Bullet solves one body after the other and reads each one's
// velocities at once. What the contacts of a later body do to an earlier one then moves it, but
// gives it no velocity. Here velocities are read when all bodies are solved.
class MendedSoftBodySolver : public btDefaultSoftBodySolver {
 public:
  void solveConstraints(btScalar seconds) override;
};

// btSoftBody::applyRepulsionForce() takes the mass of a contact's node for those of the face, takes
// nodes beside a face for ones above it, and leaves the velocity with which it pushes them away.
// Here an impulse acts on the four nodes in their own masses, stops what comes nearer and no more.
class MendedDeformableWorld : public btDeformableMultiBodyDynamicsWorld {
 public:
  using btDeformableMultiBodyDynamicsWorld::btDeformableMultiBodyDynamicsWorld;

 protected:
  void internalSingleStepSimulation(btScalar seconds) override;
};

}  // namespace lazyccd::scenes
