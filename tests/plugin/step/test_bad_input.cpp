#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "scenes/meshes/surface.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

TEST_CASE("a body with a position that is not finite is named and left out until it is finite") {
  int messages = 0;
  scenes::WorldOptions options = quiet_options(World::rigid);
  options.lazyccd.on_message = [&](const std::string&) { ++messages; };
  Impact impact(options);
  auto third = sheet(*impact.world, 4, 1, 3);
  btSoftBody* broken = third.get();
  impact.world->add(std::move(third));
  const btVector3 good = broken->m_nodes[7].m_x;
  broken->m_nodes[7].m_x = btVector3(0, std::numeric_limits<btScalar>::quiet_NaN(), 0);
  impact.steps(24);
  CHECK(impact.passed() == 0);  // the others go on colliding
  CHECK(messages == 1);
  CHECK(impact.world->status().find("soft body 2, node 7: the position is not finite") !=
        std::string::npos);
  CHECK(impact.world->total_stats()->fallback_steps == 0);

  // By now the springs have spread the bad position over the body.
  for (int i = 0; i < broken->m_nodes.size(); ++i) {
    broken->m_nodes[i].m_x = broken->m_nodes[i].m_q =
        good + btVector3(btScalar(0.1 * (i % 4)), 0, btScalar(0.1 * (i / 4)));
    broken->m_nodes[i].m_v = btVector3(0, 0, 0);
  }
  impact.steps(2);
  CHECK(impact.world->total_stats()->fallback_steps == 0);
}

TEST_CASE("a deformable world with a position that is not finite goes on") {
  Impact impact(quiet_options(World::deformable));
  impact.thrown->m_nodes[3].m_x = btVector3(std::numeric_limits<btScalar>::infinity(), 0, 0);
  impact.steps(3);
  CHECK(impact.world->status().find("is not finite") != std::string::npos);
}

TEST_CASE("an exploded body is named and left out and the others go on colliding") {
  // With exact arithmetic each step would take minutes. The test raises Bullet's own limit.
  Impact impact(quiet_options(World::rigid));
  impact.world->info().m_maxDisplacement = btScalar(1e16);
  auto third = sheet(*impact.world, 4, 1, 3);
  btSoftBody* broken = third.get();
  impact.world->add(std::move(third));
  for (int i = 0; i < broken->m_nodes.size(); ++i)
    broken->m_nodes[i].m_v = btScalar(1e14) * btVector3(i % 3 - 1, i % 5 - 2, i % 7 - 3);
  impact.steps(24);
  CHECK(impact.passed() == 0);
  CHECK(impact.world->status().find("it moves 500 m in a step") != std::string::npos);
  CHECK(impact.world->total_stats()->fallback_steps == 0);
}

TEST_CASE("a rigid body with a velocity that is not finite is named and spoils no other body") {
  // Bullet's clusters cause this after the body has moved.
  ObstacleWorld w(World::rigid, 0);
  btSoftBody* sheet = w.add_sheet(6, 1, 0.2, 2);
  btRigidBody* ball =
      w.add(std::make_unique<btSphereShape>(btScalar(0.2)), btVector3(0, btScalar(-0.01), 0), 1);
  w.world().setInternalTickCallback(
      [](btDynamicsWorld* world, btScalar) {
        const btScalar nan = std::numeric_limits<btScalar>::quiet_NaN();
        static_cast<btRigidBody*>(world->getWorldUserInfo())->setLinearVelocity({nan, nan, nan});
      },
      ball);
  w.steps(1, 1.0 / 60);
  CHECK(w.status().find("its transform or velocity is not finite") != std::string::npos);
  CHECK(w.total().energy_lost == 0);
  for (int i = 0; i < sheet->m_nodes.size(); ++i)
    CHECK(std::isfinite(sheet->m_nodes[i].m_v.length2()));
}

TEST_CASE("a reduced deformable is refused by name") {
  Impact impact(quiet_options(World::deformable));
  impact.thrown->m_reducedModel = true;
  impact.steps(2);
  CHECK(impact.world->status().find("soft body 1 is a reduced deformable") != std::string::npos);
  CHECK(impact.world->total_stats()->fallback_steps == 0);
}

TEST_CASE("an option that the detector refuses is logged once and Bullet does the step") {
  const World world = GENERATE(World::rigid, World::deformable);
  int messages = 0;
  scenes::WorldOptions options = quiet_options(world);
  options.lazyccd.detector.threads = -3;
  options.lazyccd.on_message = [&](const std::string&) { ++messages; };
  Impact impact(options, 1);
  impact.steps(5);
  CHECK(messages == 1);
  CHECK(impact.world->total_stats()->fallback_steps == 5);
  CHECK(impact.world->status().find("this step runs without LazyCCD") != std::string::npos);
  CHECK(impact.thrown->m_nodes[0].m_x.y() < btScalar(0.1));
}

TEST_CASE("nodes are read and written on several threads as on one") {
  const World kind = GENERATE(World::rigid, World::deformable);
  std::vector<std::vector<btScalar>> ends;
  for (const int threads : {1, 4}) {
    scenes::WorldOptions options = quiet_options(kind);
    options.lazyccd.detector.threads = threads;
    const auto world = PhysicsWorld::make(options);
    std::vector<btSoftBody*> bodies;
    for (int i = 0; i < 22; ++i) {  // 3168 nodes in all
      auto body = sheet(*world, 12, 1, 0.02 * i);
      throw_down(*body, i);
      bodies.push_back(body.get());
      world->add(std::move(body));
    }
    const auto steps = [&](int count) {
      for (int i = 0; i < count; ++i) world->step();
    };
    steps(3);
    bodies[19]->m_nodes[5].m_x[1] = std::numeric_limits<btScalar>::quiet_NaN();
    steps(3);
    CHECK(world->status().find("soft body 19, node ") != std::string::npos);
    CHECK(world->total_stats()->fallback_steps == 0);
    CHECK(world->total_stats()->contacts_vf > 0);
    ends.emplace_back();
    for (const btSoftBody* body : bodies) {
      for (int i = 0; body != bodies[19] && i < body->m_nodes.size(); ++i)
        for (int k = 0; k < 3; ++k) ends.back().push_back(body->m_nodes[i].m_x[k]);
    }
  }
  CHECK(ends[0] == ends[1]);
}

TEST_CASE("invalid options are logged and replaced by the defaults") {
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::string> logged;
  scenes::WorldOptions options = quiet_options(World::rigid);
  options.lazyccd.on_message = [&](const std::string& line) { logged.push_back(line); };
  options.lazyccd.thickness = nothing;
  options.lazyccd.position_correction = -2;
  options.lazyccd.restitution = -1;
  options.lazyccd.rest_damping = -100;
  options.lazyccd.untangling_speed = -nothing;
  options.lazyccd.solver_iterations = -5;
  Impact invalid(options), usual(quiet_options(World::rigid));
  invalid.steps(20);
  usual.steps(20);
  CHECK(logged.size() == 6);
  CHECK(invalid.world->status().find("SolverOptions::position_correction is -2") !=
        std::string::npos);
  CHECK(invalid.world->total_stats()->contacts_vf > 0);
  CHECK(scenes::read_positions(*invalid.world) == scenes::read_positions(*usual.world));
}

TEST_CASE("a collision margin that is not finite is logged and counts as zero") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool number = GENERATE(true, false);
  CAPTURE(world == World::rigid, number);
  using Limits = std::numeric_limits<btScalar>;
  Impact impact(quiet_options(world), 2);
  impact.steps(4);
  impact.thrown->getCollisionShape()->setMargin(number ? Limits::infinity() : Limits::quiet_NaN());
  impact.steps(24);
  CHECK(impact.world->status().find("margin is not finite") != std::string::npos);
  CHECK(impact.world->total_stats()->fallback_steps == 0);
  CHECK(impact.world->total_stats()->contacts_vf > 0);
  CHECK(impact.passed() == 0);
}
