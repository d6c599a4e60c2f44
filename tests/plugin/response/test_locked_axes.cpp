// Rigid bodies with locked axes of translation or rotation.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <cmath>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

bool is_finite(const btSoftBody& body) {
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    if (!std::isfinite(body.m_nodes[i].m_x.length2() + body.m_nodes[i].m_v.length2())) return false;
  }
  return true;
}

btRigidBody* add_box(ObstacleWorld& w, const btVector3& half, const btVector3& at) {
  btRigidBody* box = w.add(std::make_unique<btBoxShape>(half), at, 2);
  box->setActivationState(DISABLE_DEACTIVATION);
  box->setDamping(0, 0);
  return box;
}

}  // namespace

TEST_CASE("a body that may rotate but not move collides and stays finite") {
  const World world = GENERATE(World::rigid, World::deformable);
  const int max_impulse_rounds = GENERATE(0, 20);
  CAPTURE(world == World::rigid, max_impulse_rounds);
  bullet::SolverOptions options;
  options.max_impulse_rounds = max_impulse_rounds;
  ObstacleWorld w(world, 0, options);
  btRigidBody* box =
      add_box(w, btVector3(btScalar(0.5), btScalar(0.2), btScalar(0.5)), btVector3(0, 0, 0));
  box->setLinearFactor(btVector3(0, 0, 0));
  const btSoftBody* cloth = w.add_sheet(7, 1, 0.25, 4);
  w.steps(20, 1.0 / 120);
  CHECK(w.total().contacts_vf + w.total().contacts_ee > 0);
  CHECK(is_finite(*cloth));
  CHECK(std::isfinite(w.total().energy_lost));
  CHECK(box->getWorldTransform().getOrigin() == btVector3(0, 0, 0));
  CHECK(w.status().find("not finite") == std::string::npos);
}

TEST_CASE("a body on a vertical axle transfers angular momentum to cloth") {
  // An upright beam rotates into a cloth that hangs beside it.
  const bool axle = GENERATE(false, true);
  CAPTURE(axle);
  ObstacleWorld w(World::rigid, 0);
  btRigidBody* beam =
      add_box(w, btVector3(1, btScalar(0.3), btScalar(0.1)), btVector3(0, btScalar(0.05), 0));
  if (axle) beam->setAngularFactor(btVector3(0, 1, 0));
  beam->setAngularVelocity(btVector3(0, 10, 0));
  btSoftBody* cloth = w.add(scenes::make_cloth(w.info(), 3, 3, 1, [](double u, double v) {
    return btVector3(static_cast<btScalar>(-0.9 + 0.2 * u), static_cast<btScalar>(0.2 * v),
                     btScalar(0.4));
  }));
  w.steps(30, 1.0 / 120);
  double fastest = 0;
  for (int i = 0; i < cloth->m_nodes.size(); ++i)
    fastest = std::max(fastest, static_cast<double>(cloth->m_nodes[i].m_v.length()));
  CHECK(fastest > 1);
  CHECK(static_cast<double>(beam->getAngularVelocity().y()) < 9.9);
  CHECK(w.total().energy_gained < 1e-6);
}
