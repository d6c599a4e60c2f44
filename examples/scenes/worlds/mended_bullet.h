// Bullet alone, without the errors of its soft-body contacts that lose momentum or add energy
// ("mended Bullet"). It serves as a control: it shows where motion with LazyCCD differs from motion
// with Bullet, and why. It misses the same contacts as Bullet.
#pragma once

#include <BulletSoftBody/btDefaultSoftBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>

namespace lazyccd::scenes {

/// For btSoftRigidDynamicsWorld. Bullet solves one body after the other and computes the velocities
/// of each body at once. The contacts of a later body then move an earlier one without changing its
/// velocity. This solver computes the velocities after all bodies are solved.
class MendedSoftBodySolver : public btDefaultSoftBodySolver {
 public:
  void solveConstraints(btScalar seconds) override;
};

/// For btDeformableMultiBodyDynamicsWorld. btSoftBody::applyRepulsionForce() has three errors. It
/// uses the mass of the contact's node for the nodes of the face. It treats nodes beside a face as
/// if they were above it. It keeps the velocity with which it pushes nodes away. In this world an
/// impulse acts on the four nodes with their own masses. It only stops the approach.
class MendedDeformableWorld : public btDeformableMultiBodyDynamicsWorld {
 public:
  using btDeformableMultiBodyDynamicsWorld::btDeformableMultiBodyDynamicsWorld;

 protected:
  void internalSingleStepSimulation(btScalar seconds) override;
};

}  // namespace lazyccd::scenes
