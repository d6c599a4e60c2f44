// The force of cloth on one body: a cloth of 1 kg falls on a box, and the box weighs it. A frame
// has four substeps. The impulses of their contacts are added up in a callback, and divided by the
// time of the frame.
//
// Build it as bullet.cpp, which explains the world.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <lazyccd/bullet/soft_body_solver.h>

#include <cstdio>
#include <memory>

int main() {
  btBoxShape shape(btVector3(1, btScalar(0.1), 1));
  btRigidBody box(0, nullptr, &shape);  // mass 0: it stays
  btVector3 impulse(0, 0, 0);           // of the cloth on the box in this frame, N s

  lazyccd::bullet::SolverOptions options;
  // Called after each substep that has contacts. A sleeping cloth has none.
  options.on_contacts = [&](lazyccd::Span<const lazyccd::bullet::StepContact> contacts) {
    for (const lazyccd::bullet::StepContact& contact : contacts) {
      const btVector3 on_a = btScalar(contact.impulse) * contact.normal + contact.friction_impulse;
      if (contact.body_a == &box) impulse += on_a;
      if (contact.body_b == &box) impulse -= on_a;
    }
  };
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver constraints;
  lazyccd::bullet::btLazySoftBodySolver solver(options);
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &solver);
  world.setGravity(btVector3(0, -10, 0));
  world.getWorldInfo().m_gravity = world.getGravity();

  const btScalar half = btScalar(0.5), height = btScalar(0.3);
  const std::unique_ptr<btSoftBody> cloth(btSoftBodyHelpers::CreatePatch(
      world.getWorldInfo(), btVector3(-half, height, -half), btVector3(half, height, -half),
      btVector3(-half, height, half), btVector3(half, height, half), 21, 21, 0, true));
  cloth->setTotalMass(1);
  cloth->getCollisionShape()->setMargin(btScalar(0.01));
  cloth->setActivationState(DISABLE_DEACTIVATION);
  world.addRigidBody(&box);
  world.addSoftBody(cloth.get());

  const btScalar frame = btScalar(1) / 60, substep = frame / 4;
  for (int i = 1; i <= 180; ++i) {
    impulse.setZero();
    world.stepSimulation(frame, 4, substep);
    const btVector3 force = impulse / frame;
    if (i % 30 == 0) std::printf("after %.1f s: %6.2f N downwards\n", i / 60.0, -double(force.y()));
  }
  world.removeSoftBody(cloth.get());
  world.removeRigidBody(&box);
  return 0;
}
