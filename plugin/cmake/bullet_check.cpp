// Compiles with Bullet's headers in the expected precision, and links with Bullet's libraries only
// if they have the same one: btScalar is part of the names of the functions called here.
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

static_assert(sizeof(btScalar) == (LAZYCCD_EXPECTS_DOUBLE ? 8 : 4), "the other precision");

int main() {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver constraints;
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration);
  btSoftBody* body = btSoftBodyHelpers::CreateRope(world.getWorldInfo(), btVector3(0, 0, 0),
                                                   btVector3(1, 0, 0), 2, 1);
  body->setTotalMass(btScalar(1), false);
  world.addSoftBody(body);
  world.stepSimulation(btScalar(1) / 60);
  btDeformableBodySolver solver;
  solver.setImplicit(true);
  return 0;
}
