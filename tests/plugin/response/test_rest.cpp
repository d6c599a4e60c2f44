// Stacked cloths come to rest. A body that moves as a whole does not.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

void add_floor(ObstacleWorld& w) {
  w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.1), 1)),
        btVector3(0, btScalar(-0.1), 0));
}

// Cloths above each other; each is rotated and shifted against the one below.
std::vector<btSoftBody*> add_stack(ObstacleWorld& w, int layers) {
  std::vector<btSoftBody*> cloths;
  for (int i = 0; i < layers; ++i) {
    cloths.push_back(w.add(scenes::make_cloth(w.info(), 5, 5, 1, [&](double u, double v) {
      const double angle = 0.02 * i, c = std::cos(angle), s = std::sin(angle);
      const double x = 0.5 * (u - 0.5) + 0.002 * i, z = 0.5 * (v - 0.5) - 0.001 * i;
      return btVector3(static_cast<btScalar>(c * x + s * z), static_cast<btScalar>(0.03 * (i + 1)),
                       static_cast<btScalar>(c * z - s * x));
    })));
  }
  return cloths;
}

double fastest(const std::vector<btSoftBody*>& bodies) {
  double result = 0;
  for (const btSoftBody* body : bodies) {
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      result = std::max(result, static_cast<double>(body->m_nodes[i].m_v.length()));
    }
  }
  return result;
}

btVector3 momentum(const btSoftBody& body) {
  btVector3 sum(0, 0, 0);
  for (int i = 0; i < body.m_nodes.size(); ++i) sum += body.m_nodes[i].m_v / body.m_nodes[i].m_im;
  return sum;
}

}  // namespace

TEST_CASE("a stack of eight cloths comes to rest") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  add_floor(w);
  const std::vector<btSoftBody*> cloths = add_stack(w, 8);
  w.steps(300, 1.0 / 120);
  CHECK(fastest(cloths) < 1e-3);
  CHECK(w.total().energy_gained < 1e-6);
}

TEST_CASE("a body that carries a load keeps no velocity from it") {
  ObstacleWorld w(World::rigid, 10);
  add_floor(w);
  const std::vector<btSoftBody*> cloths = add_stack(w, 3);
  for (btSoftBody* cloth : cloths) cloth->m_cfg.kDP = btScalar(0.2);
  w.steps(200, 1.0 / 60);
  CHECK(fastest(cloths) < 1e-3);
}

TEST_CASE("damping to rest does not change the motion of the whole body") {
  // A cloth slides over a smooth floor, more slowly than the resting speed.
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  bullet::SolverOptions options;
  options.friction = false;
  ObstacleWorld w(world, 10, options);
  add_floor(w);
  const std::vector<btSoftBody*> cloths = add_stack(w, 1);
  w.steps(100, 1.0 / 120);
  cloths[0]->m_cfg.kDP = 0;
  for (int i = 0; i < cloths[0]->m_nodes.size(); ++i) {
    cloths[0]->m_nodes[i].m_v = btVector3(btScalar(0.02), 0, 0);
  }
  w.steps(60, 1.0 / 120);
  CHECK_THAT(static_cast<double>(momentum(*cloths[0]).x()), Matchers::WithinAbs(0.02, 0.001));
}

TEST_CASE("slow deformation in contact decays at the chosen rate, but not where contacts slide") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  // Root mean square speed along x, m/s, one step after neighbouring nodes got +0.01 and -0.01 m/s.
  const auto left_of = [world](double rest_damping, bool friction) {
    bullet::SolverOptions options;
    options.friction = friction;
    options.coulomb_friction = true;
    options.rest_damping = rest_damping;
    ObstacleWorld w(world, 10, options);
    add_floor(w);
    btSoftBody& cloth = *add_stack(w, 1)[0];
    w.steps(100, 1.0 / 120);
    cloth.m_cfg.kDF = btScalar(1e-3);  // holds 1e-4 m/s in a step
    cloth.m_cfg.kDP = 0;
    cloth.m_cfg.piterations = 0;  // links would damp it
    const int nodes = cloth.m_nodes.size();
    for (int i = 0; i < nodes; ++i)
      cloth.m_nodes[i].m_v += btVector3(i % 2 ? btScalar(0.01) : btScalar(-0.01), 0, 0);
    w.steps(1, 1.0 / 120);
    double squares = 0;
    for (int i = 0; i < nodes; ++i)
      squares += std::pow(static_cast<double>(cloth.m_nodes[i].m_v.x()), 2);
    return std::sqrt(squares / nodes);
  };
  const double without = left_of(0, false), usual = left_of(20, false),
               strong = left_of(100, false), sliding = left_of(100, true);
  INFO(without << ", " << usual << ", " << strong << ", " << sliding);
  CHECK_THAT(usual / without, Matchers::WithinAbs(std::exp(-20.0 / 120), 0.05));
  CHECK_THAT(strong / without, Matchers::WithinAbs(std::exp(-100.0 / 120), 0.05));
  CHECK_THAT(sliding / without, Matchers::WithinAbs(1, 0.05));
}

TEST_CASE("cloth whose margin is larger than its edges keeps a gap and rests still") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double margin = GENERATE(0.05, 0.25);
  CAPTURE(world == World::rigid, margin);
  ObstacleWorld w(world, 10);
  add_floor(w);
  constexpr double edge = 0.05;
  std::mt19937 random(1);
  scenes::Sheet sheet{11, 11, 10 * edge, 10 * edge};
  sheet.height = 0.4;
  btSoftBody* const cloth = w.add(scenes::make_sheet(w.info(), sheet, random));
  cloth->getCollisionShape()->setMargin(static_cast<btScalar>(margin));
  w.steps(360, 1.0 / 120);
  double lowest = 1;
  for (int i = 0; i < cloth->m_nodes.size(); ++i)
    lowest = std::min(lowest, static_cast<double>(cloth->m_nodes[i].m_x.y()));
  CHECK(lowest > std::min(0.99 * margin, 1.7 * edge));
  CHECK(fastest({cloth}) < 0.01);
}
