// Compares the motion with LazyCCD and with Bullet alone: how they differ, and why.
#include <cmath>

#include "scenes/run.h"
#include "support/catch.h"

using namespace lazyccd;

namespace {

using scenes::Collisions;
using scenes::World;

struct Run {
  scenes::Scene scene;
  scenes::RunReport report;

  Run(const char* name, World world, Collisions collisions, int steps) {
    scenes::Parameters parameters;
    parameters.world = world;
    parameters.collisions = collisions;
    parameters.speed = 2;
    parameters.size = 0.5;
    parameters.steps = steps;
    scene = scenes::set_up(*scenes::find_scene(name), parameters);
    report = scenes::run(scene);
  }
};

// Mean distance between the same nodes of both runs, in collision margins.
double apart(const Run& a, const Run& b) {
  double sum = 0;
  int count = 0;
  for (std::size_t body = 0; body < a.scene.world->bodies().size(); ++body) {
    const auto &of_a = a.scene.world->bodies()[body]->m_nodes,
               &of_b = b.scene.world->bodies()[body]->m_nodes;
    for (int i = 0; i < of_a.size(); ++i)
      sum += static_cast<double>((of_a[i].m_x - of_b[i].m_x).length());
    count += of_a.size();
  }
  return sum / count / a.report.margin;
}

}  // namespace

TEST_CASE("Bullet alone loses momentum of free cloths and mended Bullet and LazyCCD keep it") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  constexpr int steps = 40;
  // In the rigid world the scene's bodies lose the fraction kDP of their velocity in each step.
  const double kept = world == World::rigid ? std::pow(1 - 0.005, steps) : 1;
  const auto kept_with = [&](Collisions collisions) {
    const Run run("free-cloths", world, collisions, steps);
    return run.report.end.momentum[1] / (kept * run.report.start.momentum[1]);
  };
  CHECK(kept_with(Collisions::bullet) < 0.8);
  CHECK_THAT(kept_with(Collisions::mended_bullet), Matchers::WithinAbs(1, 1e-4));
  CHECK_THAT(kept_with(Collisions::lazyccd), Matchers::WithinAbs(1, 1e-4));
}

TEST_CASE("LazyCCD moves bodies as mended Bullet does") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  const Run lazy("cloth-on-cloth", world, Collisions::lazyccd, 48);
  const Run alone("cloth-on-cloth", world, Collisions::bullet, 48);
  const Run mended("cloth-on-cloth", world, Collisions::mended_bullet, 48);
  CHECK(apart(lazy, mended) < 1);
  CHECK(apart(lazy, alone) > 2 * apart(lazy, mended));
  CHECK(apart(mended, alone) > 2 * apart(lazy, mended));
}
