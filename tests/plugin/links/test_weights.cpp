// Cloth in the rigid world that carries rigid bodies much heavier than its nodes: links and
// contacts hold the weight in turn.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/soft_body_figures.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

constexpr int nodes = 17;  // along a side of the cloth
constexpr double ball_radius = 0.25, cloth_margin = 0.02;

struct Hammock {
  ObstacleWorld w;
  btSoftBody* cloth;
  btRigidBody* weight = nullptr;

  /// A cloth of 1 kg and 2 m x 2 m, pinned along its border.
  explicit Hammock(int iterations, const bullet::SolverOptions& options = {}, double gravity = 10)
      : w(World::rigid, gravity, options) {
    const auto corner = [](int x, int z) { return btVector3(btScalar(x), 0, btScalar(z)); };
    std::unique_ptr<btSoftBody> made(
        btSoftBodyHelpers::CreatePatch(w.info(), corner(-1, -1), corner(1, -1), corner(-1, 1),
                                       corner(1, 1), nodes, nodes, 0, true));
    made->setTotalMass(1);
    made->m_cfg.kDF = btScalar(0.5);
    cloth = w.add(std::move(made), cloth_margin);
    cloth->m_materials[0]->m_kLST = 1;
    cloth->m_cfg.piterations = iterations;
  }

  void pin_border() {
    for (int i = 0; i < nodes; ++i)
      for (const int node : {i, (nodes - 1) * nodes + i, i * nodes, i * nodes + nodes - 1})
        cloth->setMass(node, 0);
  }

  void add_ball(double mass) {
    weight = w.add(std::make_unique<btSphereShape>(static_cast<btScalar>(ball_radius)),
                   btVector3(0, static_cast<btScalar>(ball_radius + 0.05), 0), mass);
    weight->setActivationState(DISABLE_DEACTIVATION);
  }

  void anchor_nodes_below() {
    for (int i = 0; i < cloth->m_nodes.size(); ++i) {
      const btVector3& x = cloth->m_nodes[i].m_x;
      if (btVector3(x.x(), 0, x.z()).length() < btScalar(0.8 * ball_radius))
        cloth->appendAnchor(i, weight, true, 1);
    }
  }

  int nodes_inside_of_ball() const {
    int count = 0;
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
      count += cloth->m_nodes[i].m_x.distance(weight->getCenterOfMassPosition()) <
               btScalar(ball_radius - 0.001);
    return count;
  }
};

// Largest strain in the last two of eight seconds.
double late_strain(Hammock& hammock) {
  double largest = 0;
  hammock.w.steps(360, 1.0 / 60);
  hammock.w.steps(120, 1.0 / 60, [&](int) { largest = std::max(largest, strain(*hammock.cloth)); });
  return largest;
}

}  // namespace

TEST_CASE("cloth carries a ball like Bullet's anchors") {
  const double mass = GENERATE(sweep({1.0, 2.0, 5.0}));
  const int iterations = GENERATE(4, 10, 30);
  CAPTURE(mass, iterations);
  Hammock anchored(iterations), lying(iterations);
  for (Hammock* const hammock : {&anchored, &lying}) {
    hammock->pin_border();
    hammock->add_ball(mass);
  }
  anchored.anchor_nodes_below();
  const double limit = 1.5 * late_strain(anchored);
  CHECK(late_strain(lying) < limit);
  CHECK(lying.nodes_inside_of_ball() == 0);
  CHECK(lying.weight->getCenterOfMassPosition().y() > -1);
  CHECK(lying.weight->getLinearVelocity().length() < btScalar(0.15));
  CHECK(lying.w.total().failsafe_holds == 0);
  CHECK(lying.w.total().unresolved == 0);
}

// If the number of rounds followed the load, the cloth would throw these boxes up again and again.
TEST_CASE("boxes on a pinned cloth come to rest at any rate") {
  const double rate = GENERATE(sweep({60.0, 240.0}));
  const double mass = GENERATE(sweep({0.2, 1.0, 5.0}));
  CAPTURE(rate, mass);
  Hammock hammock(4);
  hammock.pin_border();
  hammock.weight = hammock.w.add(
      std::make_unique<btBoxShape>(btVector3(btScalar(0.35), btScalar(0.1), btScalar(0.35))),
      btVector3(0, btScalar(0.17), 0), mass);
  hammock.weight->setActivationState(DISABLE_DEACTIVATION);
  hammock.w.steps(static_cast<int>(10 * rate), 1 / rate);
  CHECK(hammock.weight->getLinearVelocity().length() < btScalar(0.02));
  CHECK(speed(*hammock.cloth) < 0.2);
  CHECK(strain(*hammock.cloth) < 1.4);
}

TEST_CASE("a ball and the free cloth that it meets keep momentum") {
  Hammock hammock(10, {}, 0);
  hammock.cloth->m_cfg.kDP = 0;
  hammock.add_ball(5);
  hammock.weight->setLinearVelocity(btVector3(btScalar(0.5), -4, 0));
  hammock.w.steps(30, 1.0 / 60);
  btVector3 sum = hammock.weight->getLinearVelocity() * 5;
  for (int i = 0; i < hammock.cloth->m_nodes.size(); ++i)
    sum += hammock.cloth->m_nodes[i].m_v / hammock.cloth->m_nodes[i].m_im;
  REQUIRE(hammock.w.total().contacts_vf > 0);
  CHECK(hammock.weight->getLinearVelocity().y() > btScalar(-3.9));
  CHECK((sum - btVector3(btScalar(2.5), -20, 0)).length() < btScalar(0.002));
}

TEST_CASE("cloth under a weight moves the same on any number of threads") {
  const auto positions = [](int threads) {
    bullet::SolverOptions options;
    options.detector.threads = threads;
    Hammock hammock(4, options);
    hammock.pin_border();
    hammock.add_ball(2);
    hammock.w.steps(90, 1.0 / 60);
    std::vector<btVector3> found{hammock.weight->getCenterOfMassPosition()};
    for (int i = 0; i < hammock.cloth->m_nodes.size(); ++i)
      found.push_back(hammock.cloth->m_nodes[i].m_x);
    return found;
  };
  const std::vector<btVector3> one = positions(1);
  CHECK(one == positions(2));
  CHECK(one == positions(4));
}
