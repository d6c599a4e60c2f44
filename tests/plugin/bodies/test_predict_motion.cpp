// In the rigid world, Bullet's own part of a step gives the same bits as with Bullet's solver, on
// any number of threads.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include "plugin/bodies/bullet_twin.h"
#include "plugin/support/obstacle_worlds.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/solid.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// Bodies side by side that never meet. Together they have enough nodes for several threads.
void build(RigidTwin& twin) {
  std::mt19937 random(3);
  twin.info().air_density = btScalar(1.2);
  const auto sheet = [&](int i) {
    scenes::Sheet s{24 + i, 22, 1, 1};
    s.jitter = 0.01;
    s.height = 3.0 * i;
    btSoftBody* const body = twin.add(scenes::make_sheet(twin.info(), s, random));
    body->setPose(false, false);
    return body;
  };
  sheet(0)->setMass(0, 0);  // hangs from a corner
  btSoftBody* const anchored = sheet(1);
  anchored->appendAnchor(5, twin.add_rigid(std::make_unique<btBoxShape>(btVector3(1, 1, 1)),
                                           anchored->m_nodes[5].m_x + btVector3(0, 10, 9), 2));
  btSoftBody* const windy = sheet(2);
  windy->m_cfg.aeromodel = btSoftBody::eAeroModel::V_TwoSidedLiftDrag;
  windy->m_cfg.kLF = windy->m_cfg.kDG = btScalar(0.1);
  windy->setWindVelocity(btVector3(1, 2, 3));
  btSoftBody* const sail = sheet(3);
  sail->m_cfg.aeromodel = btSoftBody::eAeroModel::F_TwoSided;
  sail->m_cfg.kDG = btScalar(0.3);
  btSoftBody* const matched = sheet(4);
  matched->setPose(false, true);
  matched->m_cfg.kMT = btScalar(0.1);
  btSoftBody* const sleeper = sheet(5);
  sleeper->forceActivationState(ISLAND_SLEEPING);
  sheet(6)->m_cfg.viterations = 2;
  sheet(7)->m_cfg.timescale = btScalar(0.5);
  const auto ball = [&](double height) {
    btSoftBody* const body =
        twin.add(scenes::make_ball(twin.info(), 5, 1, btVector3(5, btScalar(height), 0), 0.5));
    body->setPose(true, false);
    return body;
  };
  ball(0)->m_cfg.kPR = 50;
  ball(3)->m_cfg.kVC = 20;
  ball(6)->generateClusters(4);
}

}  // namespace

TEST_CASE("the rigid world without contacts has the bits of Bullet's solver") {
  const int threads = GENERATE(1, 2, 3);
  CAPTURE(threads);
  RigidTwin bullets(0), lazy(threads);
  build(bullets);
  build(lazy);
  check_steps(bullets, lazy, 24, [](TwinWorld& world, int step) {
    std::vector<std::unique_ptr<btSoftBody>>& bodies = world.bodies;
    if (step == 6) bodies[0]->addForce(btVector3(3, 0, 1), 7);
    if (step == 8) bodies[1]->setMass(9, 3);
    if (step == 10) bodies[2]->addVelocity(btVector3(1, 0, 0));
    if (step == 12) {
      world.world().removeCollisionObject(bodies[3].get());
      bodies.erase(bodies.begin() + 3);
    }
    if (step == 15) bodies[4]->activate(true);
    if (step == 18) bodies[5]->appendLink(3, 90);
  });
  CHECK(lazy.lazy.total_stats().contacts_vf == 0);
  CHECK(lazy.lazy.total_stats().fallback_steps == 0);
}

TEST_CASE("bodies with nodes of other bodies are predicted one after the other") {
  const int threads = GENERATE(1, 3);
  CAPTURE(threads);
  RigidTwin bullets(0), lazy(threads);
  for (RigidTwin* twin : {&bullets, &lazy}) {
    std::mt19937 random(3);
    for (int i = 0; i < 2; ++i) {
      scenes::Sheet s{40, 40, 1, 1};
      s.height = 3 * i;
      btSoftBody* const body = twin->add(scenes::make_sheet(twin->info(), s, random));
      body->m_cfg.kDG = btScalar(0.1);
      body->m_cfg.aeromodel = btSoftBody::eAeroModel::F_TwoSided;
    }
    for (const auto& body : twin->bodies) body->m_cfg.collisions = 0;
  }
  check_steps(bullets, lazy, 6, [](TwinWorld& world, int step) {
    if (step == 1)  // in the first step Bullet would write past its arrays
      world.bodies[0]->m_faces[3].m_n[1] = &world.bodies[1]->m_nodes[7];
  });
}

TEST_CASE("Bullet's own contacts with rigid bodies find nodes where they are in the rigid world") {
  bullet::SolverOptions options;
  options.replace_rigid_contacts = false;
  ObstacleWorld w(scenes::World::rigid, 0, options);
  btSoftBody* const sheet = w.add_sheet(6, 1, 0.5, 1);
  w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.4), 1)), btVector3(0, 0, 0));
  w.steps(80);
  for (int i = 0; i < sheet->m_nodes.size(); ++i) CHECK(sheet->m_nodes[i].m_x.y() > btScalar(0.38));
}
