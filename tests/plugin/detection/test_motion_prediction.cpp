// MotionPrediction: a detection starts ahead at the end of the previous step.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <array>
#include <vector>

#include "lazyccd/threads.h"
#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

bullet::SolverOptions on_threads(int threads) {
  bullet::SolverOptions options;
  options.detector.backend = Backend::cpu;
  options.detector.threads = threads;
  return options;
}

// Sheets fall on a box and on each other. They have more near pairs than one thread tests in a
// batch.
struct Fall {
  ObstacleWorld world;
  std::vector<btSoftBody*> sheets;

  Fall(World kind, int threads) : world(kind, 10, on_threads(threads)) {
    world.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.2), 1)), btVector3(0, 0, 0));
    for (const double height : {0.22, 0.25}) sheets.push_back(world.add_sheet(20, 1, height, 1));
  }

  // Changes that an application may make between two steps. The prediction knows none of them.
  void disturb(int step) {
    if (step == 15) sheets.push_back(world.add_sheet(6, 0.8, 0.4, 3));
    if (step == 25) {
      for (int n = 0; n < 5; ++n) sheets[1]->m_nodes[n].m_x += btVector3(0, btScalar(0.05), 0);
    }
    if (step == 30) sheets[0]->setVelocity(btVector3(btScalar(0.5), 0, 0));
    if (step == 35) {
      world.remove(sheets[1]);
      sheets.erase(sheets.begin() + 1);
    }
  }

  std::vector<btScalar> state() const {
    std::vector<btScalar> all;
    for (const btSoftBody* sheet : sheets) {
      for (int n = 0; n < sheet->m_nodes.size(); ++n) {
        for (int k = 0; k < 3; ++k) {
          all.push_back(sheet->m_nodes[n].m_x[k]);
          all.push_back(sheet->m_nodes[n].m_v[k]);
        }
      }
    }
    return all;
  }
};

}  // namespace

TEST_CASE("a scene ends bit-identical whether detections start ahead or not") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind == World::rigid);
  std::vector<btScalar> ends;
  for (const int threads : {1, 2, 3}) {
    CAPTURE(threads);
    Fall fall(kind, threads);
    fall.world.steps(60, 1.0 / 240, [&](int step) { fall.disturb(step); });
    CHECK(fall.world.total().contacts_vf > 0);
    CHECK(fall.world.total().fallback_steps == 0);
    if (threads == 1) {
      ends = fall.state();
      CHECK(fall.world.total().started_ahead == 0);
      continue;
    }
    CHECK(fall.state() == ends);
    if (Threads(threads).is_caller_only()) {
      WARN("skipped: there are no threads");
      continue;
    }
    // In many steps the other thread may start too late, but not in all of them.
    for (int step = 0; step < 5000 && fall.world.total().started_ahead == 0; ++step)
      fall.world.steps(1);
    CHECK(fall.world.total().started_ahead > 0);
    CHECK(fall.world.total().started_ahead <= fall.world.total().detections);
  }
}

TEST_CASE("detections start ahead again after bodies separate and meet again") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind == World::rigid);
  std::vector<btScalar> ends;
  for (const int threads : {1, 2}) {
    Fall fall(kind, threads);
    fall.world.steps(60, 1.0 / 240, [&](int step) {
      if (step != 20) return;
      for (btSoftBody* sheet : fall.sheets) sheet->translate(btVector3(0, btScalar(0.1), 0));
    });
    if (threads == 1) ends = fall.state();
    CHECK(fall.state() == ends);
    CHECK(fall.world.total().contacts_vf > 0);
  }
}
