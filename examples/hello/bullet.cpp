// A plain Bullet program in which one cloth flies into another. LazyCCD needs only the two lines
// that are marked with its name.
//
// The net is a cloth of 2 m by 2 m, pinned along its border. A cloth of 1 m by 1 m flies at it with
// 30 m/s, which is half a metre in each step. With Bullet alone it passes through the net. With
// LazyCCD it does not.
//
// With CMake: find_package(LazyCCD REQUIRED), then link LazyCCD::bullet. By hand, after
// `cmake --install build`:
//
// g++ -std=c++17 bullet.cpp $(pkg-config --cflags --libs lazyccd-bullet)
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

/// Makes a square cloth of `nodes` x `nodes` nodes, 2 * half_width metres wide, level at `height`.
std::unique_ptr<btSoftBody> make_cloth(btSoftBodyWorldInfo& info, btScalar half_width,
                                       btScalar height, int nodes, bool pinned) {
  std::unique_ptr<btSoftBody> cloth(btSoftBodyHelpers::CreatePatch(
      info, btVector3(-half_width, height, -half_width), btVector3(half_width, height, -half_width),
      btVector3(-half_width, height, half_width), btVector3(half_width, height, half_width), nodes,
      nodes, 0, true));
  // Asks for contacts with other soft bodies. Two bodies without this flag pass through each other,
  // with Bullet alone and with LazyCCD.
  cloth->m_cfg.collisions |= btSoftBody::fCollision::VF_SS;
  cloth->m_cfg.piterations = 10;
  cloth->setTotalMass(1);
  // A node of mass 0 is pinned.
  for (int i = 0; pinned && i < nodes * nodes; ++i) {
    const int row = i / nodes, column = i % nodes;
    if (row == 0 || column == 0 || row == nodes - 1 || column == nodes - 1) cloth->setMass(i, 0);
  }
  cloth->getCollisionShape()->setMargin(btScalar(0.01));
  return cloth;
}

/// Returns the height of the lowest node, metres.
btScalar lowest_node(const btSoftBody& body) {
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

  std::printf("lowest node of the net: %.2f m, of the thrown cloth: %.2f m; the thrown cloth %s\n",
              double(lowest_node(*net)), double(lowest_node(*thrown)),
              lowest_node(*net) < lowest_node(*thrown) ? "was stopped" : "passed through");
  std::printf("%s", solver.status().c_str());
  world.removeSoftBody(thrown.get());
  world.removeSoftBody(net.get());
  return 0;
}
