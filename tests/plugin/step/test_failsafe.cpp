#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "random/random_source.h"
#include "scenes/measures/intersections.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;

TEST_CASE("nodes held at the start of the step are enough and are counted") {
  const World world = GENERATE(World::rigid, World::deformable);
  scenes::WorldOptions options = quiet_options(world, 1.0 / 60);
  options.lazyccd.max_impulse_rounds = 0;
  options.lazyccd.max_zone_rounds = 0;
  Impact impact(options, 30);
  scenes::CrossingCounter crossings(*impact.world);
  for (int i = 0; i < 6; ++i) {
    impact.world->step();
    crossings.step(*impact.world);
  }
  CHECK(crossings.vertex_face() + crossings.edge_edge() == 0);
  CHECK(impact.passed() == 0);
  CHECK(impact.world->total_stats()->failsafe_holds > 0);
  CHECK(impact.world->status().find("fail-safe holds") != std::string::npos);
}

TEST_CASE("impact zones are enough without impulses") {
  const World world = GENERATE(World::rigid, World::deformable);
  scenes::WorldOptions options = quiet_options(world, 1.0 / 60);
  options.lazyccd.max_impulse_rounds = 0;
  Impact impact(options, 30);
  scenes::CrossingCounter crossings(*impact.world);
  for (int i = 0; i < 6; ++i) {
    impact.world->step();
    crossings.step(*impact.world);
  }
  CHECK(crossings.vertex_face() + crossings.edge_edge() == 0);
  CHECK(impact.world->total_stats()->impact_zone_nodes > 0);
}

TEST_CASE("a moving pinned sheet pushes a free sheet along") {
  const World world = GENERATE(World::rigid, World::deformable);
  Impact impact(quiet_options(world), 0);
  scenes::pin(*impact.held, 0, impact.held->m_nodes.size() - 1);
  impact.held->m_cfg.kDP = 0;
  scenes::CrossingCounter crossings(*impact.world);
  for (int i = 0; i < 30; ++i) {
    for (int n = 0; n < impact.held->m_nodes.size(); ++n) {
      impact.held->m_nodes[n].m_v = btVector3(0, 4, 0);
    }
    impact.world->step();
    crossings.step(*impact.world);
  }
  CHECK(impact.held->m_nodes[0].m_x.y() > btScalar(0.3));
  CHECK(crossings.vertex_face() + crossings.edge_edge() == 0);
  CHECK(impact.passed() == 0);
}

TEST_CASE("the free corner of a face follows a kinematic body though the others are pinned") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  bullet::SolverOptions options;
  options.max_impulse_rounds = 0;
  ObstacleWorld w(world, 0, options);
  btSoftBody* cloth = w.add(scenes::make_cloth(w.info(), 2, 2, 1, [](double u, double v) {
    return btVector3(static_cast<btScalar>(u), 0, static_cast<btScalar>(v));
  }));
  for (const int corner : {0, 2, 3}) cloth->setMass(corner, 0);
  btRigidBody* box =
      w.add(std::make_unique<btBoxShape>(btVector3(btScalar(0.03), btScalar(0.03), btScalar(0.03))),
            btVector3(btScalar(0.85), btScalar(-0.1), btScalar(0.1)));
  ObstacleWorld::make_kinematic(*box);
  w.steps(1, 1.0 / 60);
  box->setWorldTransform(btTransform(btQuaternion::getIdentity(),
                                     btVector3(btScalar(0.85), btScalar(0.1), btScalar(0.1))));
  w.steps(1, 1.0 / 60);
  CHECK(w.last().impact_zone_nodes > 0);
  CHECK(w.last().unresolved == 0);
  CHECK(cloth->m_nodes[1].m_x.y() > btScalar(0.19));
}

TEST_CASE("no response moves a rigid body along or rotates it about a locked axis") {
  const World world = GENERATE(World::rigid, World::deformable);
  const int iterations = GENERATE(0, 20);
  CAPTURE(world == World::rigid, iterations);
  bullet::SolverOptions options;
  options.max_impulse_rounds = iterations;
  ObstacleWorld w(world, 0, options);
  w.add_sheet(6, 1, 0, 0);
  btRigidBody* box =
      w.add(std::make_unique<btBoxShape>(btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1))),
            btVector3(btScalar(0.4), btScalar(0.3), btScalar(0.3)), 1);
  box->setAngularFactor(0);
  box->setLinearFactor(btVector3(0, 1, 1));
  box->setLinearVelocity(btVector3(0, -20, 0));
  w.steps(4, 1.0 / 60);
  REQUIRE(w.total().contacts_vf > 0);
  CHECK(box->getWorldTransform().getBasis() == btMatrix3x3::getIdentity());
  CHECK(box->getWorldTransform().getOrigin().x() == btScalar(0.4));
  CHECK(box->getAngularVelocity().length() == 0);
}

TEST_CASE("a kinematic body does not press a rigid body along a locked axis") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btSoftBody* sheet = w.add_sheet(6, 1, 0, 0);
  const auto box = [] {
    return std::make_unique<btBoxShape>(btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1)));
  };
  // The sheet hangs between a box on rails and a kinematic one that comes along the locked axis.
  btRigidBody* railed = w.add(box(), btVector3(0, btScalar(-0.13), 0), 1);
  railed->setLinearFactor(btVector3(1, 0, 1));
  railed->setAngularFactor(0);
  btRigidBody* pusher = w.add(box(), btVector3(0, btScalar(0.3), 0), 0);
  pusher->setCollisionFlags(pusher->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  for (int step = 0; step < 12; ++step) {
    btTransform pose = pusher->getWorldTransform();
    pose.getOrigin() -= btVector3(0, btScalar(0.03), 0);
    pusher->setWorldTransform(pose);
    w.steps(1, 1.0 / 60);
  }
  REQUIRE(w.total().contacts_vf > 0);
  CHECK(sheet->isActive());
  CHECK(railed->getWorldTransform().getOrigin().y() == btScalar(-0.13));
  CHECK(railed->getLinearVelocity().y() == 0);
}

TEST_CASE("a sheet that lies exactly on another neither falls through nor sticks") {
  // Each node of the upper sheet starts at the position of a node of the lower one.
  const World world = GENERATE(World::rigid, World::deformable);
  auto w = PhysicsWorld::make(quiet_options(world));
  const auto flat = [&] {
    return scenes::make_cloth(w->info(), 5, 5, 1, [](double u, double v) {
      return btVector3(static_cast<btScalar>(u), 0, static_cast<btScalar>(v));
    });
  };
  auto lower = flat(), upper = flat();
  scenes::pin(*lower, 0, 24);
  btSoftBody* moving = upper.get();
  w->add(std::move(lower));
  w->add(std::move(upper));
  for (int i = 0; i < 24; ++i) {
    throw_down(*moving, 0.1);
    w->step();
  }
  for (int i = 0; i < 25; ++i) CHECK(moving->m_nodes[i].m_x.y() > 0);
  CHECK(w->total_stats()->initial_contacts == 0);  // the two were parted before
  throw_down(*moving, -1);
  for (int i = 0; i < 24; ++i) w->step();
  CHECK(moving->m_nodes[12].m_x.y() > btScalar(0.05));
}

TEST_CASE("initial intersections are reported and do not get worse") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  auto w = PhysicsWorld::make(quiet_options(world));
  auto lower = sheet(*w, 9, 1, 0);
  scenes::pin_border(*lower, 9, 9);
  // The upper cloth is upright and intersects the lower one.
  auto upper = scenes::make_cloth(w->info(), 5, 5, 1, [](double u, double v) {
    return btVector3(static_cast<btScalar>(0.3 * u - 0.113), static_cast<btScalar>(0.3 * v - 0.17),
                     static_cast<btScalar>(0.01 * u + 0.013));
  });
  w->add(std::move(lower));
  w->add(std::move(upper));
  const auto intersections = [&] {
    return scenes::find_intersections(scenes::read_surface(*w), scenes::read_positions(*w)).size();
  };
  const std::size_t before = intersections();
  REQUIRE(before > 0);
  for (int i = 0; i < 24; ++i) w->step();
  CHECK(w->total_stats()->initial_intersections == static_cast<std::int64_t>(before));
  CHECK(w->status().find("bodies intersect at the start of a step") != std::string::npos);
  CHECK(intersections() <= before);
}

TEST_CASE("impulses are soon given up if everything sweeps through everything") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  const auto scenes_tested = static_cast<unsigned>(repetitions(10));
  std::int64_t detections = 0;
  for (unsigned scene_seed = 1; scene_seed <= scenes_tested; ++scene_seed) {
    ObstacleWorld w(world, 0);
    // Every node moves in its own direction by ten times the width of the scene in a step. A plate
    // moves through them.
    RandomSource random(scene_seed);
    for (int layer = 0; layer < 6; ++layer) {
      const auto place = [&](double u, double v) {
        return btVector3(static_cast<btScalar>(0.01 * u), static_cast<btScalar>(0.001 * layer),
                         static_cast<btScalar>(0.01 * v)) +
               random.in_cube(2e-4);
      };
      btSoftBody* const cloth = w.add(scenes::make_cloth(w.info(), 6, 6, 1, place), 1e-5);
      for (int i = 0; i < cloth->m_nodes.size(); ++i) {
        cloth->setMass(i, static_cast<btScalar>(random.across_scales(1e-3, 1e3)));
        cloth->m_nodes[i].m_v = btScalar(24) * random.direction();
      }
    }
    btRigidBody* const plate = w.add(
        std::make_unique<btBoxShape>(btVector3(btScalar(0.02), btScalar(0.001), btScalar(0.02))),
        btVector3(0, btScalar(-0.01), 0), 0, 1e-5);
    ObstacleWorld::make_kinematic(*plate);
    w.steps(1);
    plate->setCenterOfMassTransform(
        btTransform(btQuaternion(btVector3(1, 0, 0), 1), btVector3(0, btScalar(0.1), 0)));
    w.steps(1);
    CHECK(w.total().impact_zone_nodes > 100);
    CHECK(w.total().unresolved == 0);
    detections += w.total().detections;
  }
  CHECK(detections < 45 * scenes_tested);  // two steps per scene
}
