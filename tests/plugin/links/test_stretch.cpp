// Contacts do not stretch links of the rigid world: turns of links and contacts, and the strain
// limit.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::vector;
using scenes::World;

namespace {

constexpr double frame = 1.0 / 60;

struct StretchWorld {
  ObstacleWorld w;

  explicit StretchWorld(const bullet::SolverOptions& options = {}) : w(World::rigid, 10, options) {}

  btSoftBody* add_cloth(int nodes, double width, double height, double mass) {
    btSoftBody* const cloth =
        w.add(scenes::make_cloth(w.info(), nodes, nodes, mass,
                                 [=](double u, double v) {
                                   return vector((u - 0.5) * width, height, (v - 0.5) * width);
                                 }),
              0.005);
    cloth->m_materials[0]->m_kLST = 1;
    cloth->m_cfg.piterations = 4;
    return cloth;
  }

  /// The longest link of the whole run, over its rest length.
  double longest(const btSoftBody& body, int steps) {
    btScalar longest = 0;
    w.steps(steps, frame, [&](int) {
      for (int i = 0; i < body.m_links.size(); ++i) {
        const btSoftBody::Link& link = body.m_links[i];
        longest = std::max(longest, (link.m_n[0]->m_x - link.m_n[1]->m_x).length() / link.m_rl);
      }
    });
    return static_cast<double>(longest);
  }
};

// On a ball of 3 cm: gravity moves a node by a quarter of an edge in a step.
double stretch_on_small_ball(const bullet::SolverOptions& options) {
  StretchWorld scene(options);
  scene.w.add(std::make_unique<btSphereShape>(btScalar(0.03)), btVector3(0, 0, 0));
  btSoftBody* const cloth = scene.add_cloth(11, 0.1, 0.04, 0.002);
  return scene.longest(*cloth, 60);
}

// A box falls on a cloth whose corners are pinned.
struct Carried {
  StretchWorld scene;
  btSoftBody* cloth;

  Carried(double ratio, const bullet::SolverOptions& options, double height = 0.3)
      : scene(options) {
    constexpr int nodes = 13;
    constexpr double mass = 0.1;
    cloth = scene.add_cloth(nodes, 2, 0, mass);
    for (const int corner : {0, nodes - 1, nodes * (nodes - 1), nodes * nodes - 1})
      cloth->setMass(corner, 0);
    const btScalar half = btScalar(0.2);
    scene.w.add(std::make_unique<btBoxShape>(btVector3(half, half, half)), vector(0, height, 0),
                static_cast<btScalar>(ratio * mass));
  }
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace

TEST_CASE("cloth that lies on a ball of few edges keeps its links") {
  CHECK(stretch_on_small_ball({}) < 2.5);
}

TEST_CASE("the strain limit holds links under a weight, and can be left out") {
  bullet::SolverOptions unlimited;
  unlimited.strain_limit = 0;
  // Chaotic: from start to start the longest link is 3.5 to 7.4. Sanitizers run one start.
  const int starts = lazyccd::test::is_sanitized ? 1 : 15;
  std::vector<double> held, longest;
  for (int i = 0; i < starts; ++i) {
    const double height = 0.3 + 0.003 * i;
    Carried limited(100, {}, height), free(100, unlimited, height);
    held.push_back(limited.scene.longest(*limited.cloth, 90));
    longest.push_back(free.scene.longest(*free.cloth, 90));
    CHECK(limited.scene.w.total().strained_links > 0);
    CHECK(free.scene.w.total().strained_links == 0);
  }
  CHECK((starts == 1 || median(held) < 6));
  CHECK(median(longest) > 2 * median(held));
}

TEST_CASE("the strain limit also holds links that what was not near before stretches") {
  // Chaotic: of 200 starts one in nine exceeds 2.2, by up to 3.8. With one look at the links,
  // before what touches is found, four in five do.
  const int starts = lazyccd::test::is_sanitized ? 1 : 45;
  std::vector<double> longest;
  for (int i = 0; i < starts; ++i) {
    StretchWorld scene;
    scene.w.add(std::make_unique<btSphereShape>(btScalar(0.3)), btVector3(0, 0, 0));
    btSoftBody* const cloth = scene.add_cloth(13, 1.2, 0.6 + 0.002 * i, 0.5);
    for (int n = 0; n < cloth->m_nodes.size(); ++n) cloth->m_nodes[n].m_v = vector(0, -30, 0);
    longest.push_back(scene.longest(*cloth, 30));
  }
  CHECK(median(longest) < 2.2);
  const auto beyond =
      std::count_if(longest.begin(), longest.end(), [](double x) { return x > 2.2; });
  CHECK(beyond <= starts / 3);
}

TEST_CASE("links at the strain limit move the same on any number of threads") {
  std::vector<std::vector<btVector3>> ends;
  for (const int threads : {1, 3}) {
    bullet::SolverOptions options;
    options.detector.threads = threads;
    Carried carried(100, options);
    carried.scene.longest(*carried.cloth, 60);
    CHECK(carried.scene.w.total().strained_links > 0);
    std::vector<btVector3>& end = ends.emplace_back();
    for (int i = 0; i < carried.cloth->m_nodes.size(); ++i)
      end.push_back(carried.cloth->m_nodes[i].m_x);
  }
  CHECK(ends[0] == ends[1]);
}

TEST_CASE(
    "a body moves the same to the bit, whether links elsewhere reach the strain limit or not") {
  std::vector<std::vector<btVector3>> ends;
  for (const double limit : {0.0, 2.0}) {
    bullet::SolverOptions options;
    options.strain_limit = limit;
    Carried carried(100, options);
    // Falls on a ball of its own, far away. Its links stay below the limit.
    btSoftBody* const other = carried.scene.add_cloth(13, 2, 0.5, 0.1);
    other->translate(vector(50, 0, 0));
    carried.scene.w.add(std::make_unique<btSphereShape>(btScalar(0.3)), vector(50, 0, 0));
    carried.scene.longest(*carried.cloth, 60);
    CHECK((carried.scene.w.total().strained_links > 0) == (limit > 0));
    std::vector<btVector3>& end = ends.emplace_back();
    for (int i = 0; i < other->m_nodes.size(); ++i) end.push_back(other->m_nodes[i].m_x);
  }
  CHECK(ends[0] == ends[1]);
}

TEST_CASE("links at the strain limit are kept while other bodies come and go") {
  Carried carried(10, {});
  carried.scene.longest(*carried.cloth, 45);
  btSoftBody* const other = carried.scene.add_cloth(5, 0.5, 2, 0.1);
  CHECK(carried.scene.longest(*carried.cloth, 20) < 4);
  carried.scene.w.remove(other);
  CHECK(carried.scene.longest(*carried.cloth, 20) < 4);
}

TEST_CASE("nothing that touches nothing is held by the strain limit") {
  StretchWorld scene;
  btSoftBody* const cloth = scene.add_cloth(7, 1, 0, 0.1);
  cloth->setMass(0, 0);
  cloth->m_materials[0]->m_kLST = btScalar(0.01);
  CHECK(scene.longest(*cloth, 60) > 1.5);
  CHECK(scene.w.total().strained_links == 0);
}
