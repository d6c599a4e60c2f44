// Drops a cloth on a box in both of Bullet's worlds with soft bodies. Prints a hash of where the
// nodes end; it is the same wherever Bullet and LazyCCD do the same arithmetic.
#include <btBulletDynamicsCommon.h>
#include <lazyccd/bullet/deformable_body_solver.h>
#include <lazyccd/bullet/soft_body_solver.h>

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <cstdint>
#include <cstdio>
#include <cstring>

namespace {

// FNV-1a over the bytes of a number.
void add_to_hash(std::uint64_t& hash, btScalar number) {
  unsigned char bytes[sizeof(number)];
  std::memcpy(bytes, &number, sizeof(number));
  for (unsigned char byte : bytes) hash = (hash ^ byte) * 1099511628211u;
}

// Steps the world, and returns whether no node went through the box. The box is 2 m wide and 0.2 m
// high.
template <class World>
bool drop_cloth(World& world, const char* name) {
  world.setGravity(btVector3(0, -10, 0));
  world.getWorldInfo().m_gravity.setValue(0, -10, 0);
  btBoxShape shape(btVector3(1, btScalar(0.1), 1));
  btRigidBody box(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &shape));
  world.addRigidBody(&box);

  const btScalar half = btScalar(0.5), height = btScalar(0.4);
  btSoftBody* cloth = btSoftBodyHelpers::CreatePatch(
      world.getWorldInfo(), btVector3(-half, height, -half), btVector3(half, height, -half),
      btVector3(-half, height, half), btVector3(half, height, half), 9, 9, 0, true);
  cloth->getCollisionShape()->setMargin(btScalar(0.02));
  cloth->setTotalMass(btScalar(0.5));
  cloth->setVelocity(btVector3(0, -20, 0));
  cloth->m_cfg.collisions |= btSoftBody::fCollision::SDF_RDF;
  world.addSoftBody(cloth);

  for (int step = 0; step < 60; ++step) world.stepSimulation(btScalar(1.0 / 60), 0);

  bool above = true;
  std::uint64_t hash = 14695981039346656037u;
  for (int i = 0; i < cloth->m_nodes.size(); ++i) {
    const btVector3& place = cloth->m_nodes[i].m_x;
    above = above && place.y() > btScalar(0.09);
    for (int axis = 0; axis < 3; ++axis) add_to_hash(hash, place[axis]);
  }
  std::printf("%-10s %s, hash %016llx\n", name, above ? "rests on the box" : "WENT THROUGH",
              static_cast<unsigned long long>(hash));
  world.removeSoftBody(cloth);
  delete cloth;
  world.removeRigidBody(&box);
  return above;
}

}  // namespace

int main() {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  bool good = true;
  {
    btSequentialImpulseConstraintSolver constraints;
    lazyccd::bullet::btLazySoftBodySolver solver;
    btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &solver);
    good = drop_cloth(world, "rigid") && good;
    std::printf("%s\n", solver.status().c_str());
  }
  {
    lazyccd::bullet::btLazyDeformableBodySolver solver;
    btDeformableMultiBodyConstraintSolver constraints;
    constraints.setDeformableSolver(&solver);
    btDeformableMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration,
                                             &solver);
    good = drop_cloth(world, "deformable") && good;
    std::printf("%s\n", solver.status().c_str());
  }
  return good ? 0 : 1;
}
