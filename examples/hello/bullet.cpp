// A plain Bullet program: one cloth flies into another. The two lines marked LazyCCD are the
// change.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <lazyccd/bullet/soft_body_solver.h>  // LazyCCD: added

#include <cstdio>
#include <memory>

namespace {

std::unique_ptr<btSoftBody> make_cloth(btSoftBodyWorldInfo& info, btScalar half, btScalar height,
                                       int nodes, bool held) {
  std::unique_ptr<btSoftBody> cloth(btSoftBodyHelpers::CreatePatch(
      info, btVector3(-half, height, -half), btVector3(half, height, -half),
      btVector3(-half, height, half), btVector3(half, height, half), nodes, nodes, 0, true));
  cloth->m_cfg.collisions |= btSoftBody::fCollision::VF_SS;
  cloth->m_cfg.piterations = 10;
  cloth->setTotalMass(1);
  for (int i = 0; held && i < nodes * nodes; ++i) {
    const int row = i / nodes, column = i % nodes;
    if (row == 0 || column == 0 || row == nodes - 1 || column == nodes - 1) cloth->setMass(i, 0);
  }
  cloth->getCollisionShape()->setMargin(btScalar(0.01));
  return cloth;
}

btScalar lowest(const btSoftBody& body) {
  btScalar y = body.m_nodes[0].m_x.y();
  for (int i = 1; i < body.m_nodes.size(); ++i) y = btMin(y, body.m_nodes[i].m_x.y());
  return y;
}

}  // namespace

int main() {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver constraints;
  lazyccd::bullet::btLazySoftBodySolver solver;  // LazyCCD: was btDefaultSoftBodySolver
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &solver);
  world.setGravity(btVector3(0, 0, 0));
  world.getWorldInfo().m_gravity.setZero();

  const auto net = make_cloth(world.getWorldInfo(), 1, 0, 31, true);
  const auto thrown = make_cloth(world.getWorldInfo(), btScalar(0.5), btScalar(0.2), 20, false);
  thrown->setVelocity(btVector3(0, -30, 0));
  world.addSoftBody(net.get());
  world.addSoftBody(thrown.get());
  for (int step = 0; step < 30; ++step) world.stepSimulation(btScalar(1) / 60, 0);

  std::printf("the net reaches down to %.2f m, the thrown cloth to %.2f m: it was %s\n",
              double(lowest(*net)), double(lowest(*thrown)),
              lowest(*net) < lowest(*thrown) ? "caught" : "not caught");
  std::printf("%s", solver.status().c_str());
  world.removeSoftBody(thrown.get());
  world.removeSoftBody(net.get());
  return 0;
}
