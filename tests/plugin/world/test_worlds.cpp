// The ways to add LazyCCD to Bullet's worlds.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include "lazyccd/bullet/collision_algorithm.h"
#include "lazyccd/bullet/soft_body_solver.h"
#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

TEST_CASE("the deformable solver works in Bullet's own world class too") {
  scenes::WorldOptions options = quiet_options(World::deformable);
  options.stock_world = true;
  Impact impact(options, 30);
  impact.steps(12);
  CHECK(impact.passed() == 0);
  CHECK(impact.world->total_stats()->contacts_vf > 0);
  // Bullet's discrete contact handling was off only while it would have acted.
  CHECK((impact.thrown->m_cfg.collisions & btSoftBody::fCollision::VF_DD) != 0);
}

TEST_CASE("Bullet's own world class gives bit-identical results") {
  scenes::WorldOptions options = quiet_options(World::deformable);
  const double speed = GENERATE(1, 10);
  Impact in_ours(options, speed);
  options.stock_world = true;
  Impact in_bullets(options, speed);
  for (Impact* const impact : {&in_ours, &in_bullets}) {
    for (btSoftBody* const body : {impact->held, impact->thrown}) {
      body->setSelfCollision(true);
      body->initializeFaceTree();  // Bullet's discrete detection uses it; not needed here
    }
  }
  for (int step = 0; step < 40; ++step) {
    CAPTURE(speed, step);
    in_ours.steps(1);
    in_bullets.steps(1);
    for (int i = 0; i < in_ours.thrown->m_nodes.size(); ++i)
      REQUIRE(in_ours.thrown->m_nodes[i].m_x == in_bullets.thrown->m_nodes[i].m_x);
  }
  CHECK(in_ours.world->total_stats()->contacts_vf > 0);
}

TEST_CASE("Bullet's own world class does not act on pairs that filters forbid") {
  // Bullet's discrete contact handling of deformables ignores filters.
  scenes::WorldOptions options = quiet_options(World::deformable);
  options.stock_world = true;
  Impact impact(options, 1, 2, 2);
  impact.steps(60);
  CHECK(impact.passed() == 36);
}

namespace {

// Throws one sheet at another in a world of soft and rigid bodies. Returns how many nodes passed
// through.
template <class DynamicsWorld>
int passed_in(DynamicsWorld& world, double speed) {
  world.setGravity(btVector3(0, 0, 0));
  world.getWorldInfo().m_gravity.setZero();
  std::mt19937 random(1);
  scenes::Sheet lower{9, 9, 2, 2}, upper{6, 6, 1, 1};
  lower.jitter = upper.jitter = 0.002;
  upper.height = 0.1;
  const auto held = scenes::make_sheet(world.getWorldInfo(), lower, random);
  const auto thrown = scenes::make_sheet(world.getWorldInfo(), upper, random);
  scenes::pin_border(*held, 9, 9);
  throw_down(*thrown, speed);
  for (btSoftBody* body : {held.get(), thrown.get()}) {
    body->m_cfg.collisions |= btSoftBody::fCollision::VF_SS;
    body->getCollisionShape()->setMargin(btScalar(0.01));
    world.addSoftBody(body);
  }
  for (int i = 0; i < 24; ++i) world.stepSimulation(btScalar(1) / 240, 0);
  const int passed = scenes::nodes_below(*thrown, 0, 35, *held);
  world.removeSoftBody(thrown.get());
  world.removeSoftBody(held.get());
  return passed;
}

}  // namespace

TEST_CASE("the soft body solver works in the multibody world") {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver constraints;
  bullet::btLazySoftBodySolver solver;
  btSoftMultiBodyDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration,
                                     &solver);
  CHECK(passed_in(world, 30) == 0);
  CHECK(solver.total_stats().contacts_vf > 0);
}

TEST_CASE("LazyCCD's collision configuration passes pairs to the solver") {
  bullet::btLazySoftBodySolver solver;
  bullet::btLazySoftBodyCollisionConfiguration configuration(solver);
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver constraints;
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &solver);
  CHECK(passed_in(world, 5) == 0);
  CHECK(solver.total_stats().handled_pairs > 0);
}

TEST_CASE("LazyCCD's algorithm registered at a dispatcher passes pairs to the solver") {
  bullet::btLazySoftBodySolver solver;
  bullet::btLazySoftSoftCollisionAlgorithm::CreateFunc create(solver);
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  bullet::register_soft_soft(dispatcher, create);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver constraints;
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &constraints, &configuration, &solver);
  CHECK(passed_in(world, 5) == 0);
  CHECK(solver.total_stats().handled_pairs > 0);
}

TEST_CASE("pairs with clusters in common stay with Bullet") {
  Impact impact(quiet_options(World::rigid));
  for (btSoftBody* body : {impact.held, impact.thrown}) {
    body->m_cfg.collisions = btSoftBody::fCollision::CL_SS;
    body->generateClusters(4);
  }
  impact.steps(10);
  CHECK(impact.world->total_stats()->contacts_vf == 0);
  CHECK(impact.world->total_stats()->handled_pairs == 0);
}

TEST_CASE("a ghost object goes through a deformable body") {
  ObstacleWorld w(World::deformable, 0);
  const btSoftBody* const sheet = w.add_sheet(9, 1, 0, 0);
  btSphereShape sphere(btScalar(0.2));
  btGhostObject ghost;
  ghost.setCollisionShape(&sphere);
  ghost.setCollisionFlags(GENERATE(int(btCollisionObject::CF_NO_CONTACT_RESPONSE),
                                   int(btCollisionObject::CF_CHARACTER_OBJECT)));
  const auto place = [&](double height) {
    ghost.setWorldTransform(
        btTransform(btQuaternion::getIdentity(), btVector3(0, static_cast<btScalar>(height), 0)));
  };
  place(0.5);
  w.world().addCollisionObject(&ghost);
  w.steps(60, 1.0 / 60, [&](int i) { place(0.5 - i / 60.0); });
  w.world().removeCollisionObject(&ghost);
  for (int i = 0; i < sheet->m_nodes.size(); ++i)
    CHECK(static_cast<double>(sheet->m_nodes[i].m_v.length()) < 1e-3);
}
