// Soft bodies with inner pressure in the rigid world: links and contacts carry it in turn.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/soft_body_figures.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

constexpr double radius = 0.3, margin = 0.02;

struct Balls {
  ObstacleWorld w;

  explicit Balls(double gravity = 10, const bullet::SolverOptions& options = {})
      : w(World::rigid, gravity, options) {}

  void add_ground() {
    w.add(std::make_unique<btBoxShape>(btVector3(10, 1, 10)), btVector3(0, -1, 0));
  }

  /// A ball of stiff links at this height; `pressure`: kPR.
  btSoftBody* add(double height, double pressure, double mass = 0.5) {
    const auto size = static_cast<btScalar>(radius);
    std::unique_ptr<btSoftBody> made(
        btSoftBodyHelpers::CreateEllipsoid(w.info(), btVector3(0, static_cast<btScalar>(height), 0),
                                           btVector3(size, size, size), 128));
    made->generateBendingConstraints(2);
    made->setTotalMass(static_cast<btScalar>(mass), true);
    made->m_cfg.kPR = static_cast<btScalar>(pressure);
    made->m_cfg.kDF = 1;
    btSoftBody* const body = w.add(std::move(made), margin);
    body->m_materials[0]->m_kLST = 1;
    body->m_cfg.piterations = 5;
    return body;
  }
};

double height_of(const btSoftBody& body) {
  btScalar low = body.m_nodes[0].m_x.y(), high = low;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    low = std::min(low, body.m_nodes[i].m_x.y());
    high = std::max(high, body.m_nodes[i].m_x.y());
  }
  return static_cast<double>(high - low);
}

btVector3 momentum(const btSoftBody& body) {
  btVector3 sum(0, 0, 0);
  for (int i = 0; i < body.m_nodes.size(); ++i) sum += body.m_nodes[i].m_v / body.m_nodes[i].m_im;
  return sum;
}

}  // namespace

TEST_CASE("a ball with pressure stays round on the ground") {
  const double pressure = GENERATE(5.0, 20.0, 60.0, 120.0);
  const double drop = GENERATE(0.02, 0.5);
  CAPTURE(pressure, drop);
  Balls balls;
  balls.add_ground();
  const btSoftBody& ball = *balls.add(radius + margin + drop, pressure);
  const double volume = static_cast<double>(ball.getVolume());
  double largest_strain = 1;
  balls.w.steps(180, 1.0 / 60,
                [&](int) { largest_strain = std::max(largest_strain, strain(ball)); });
  CHECK(static_cast<double>(ball.getVolume()) > 0.97 * volume);
  CHECK(height_of(ball) > 0.85 * 2 * radius);
  CHECK(largest_strain < 1.6);
  CHECK(balls.w.total().failsafe_holds == 0);
}

TEST_CASE("balls with pressure carry a ball or a box") {
  const bool carries_box = GENERATE(false, true);
  CAPTURE(carries_box);
  Balls balls;
  balls.add_ground();
  const double pressure = 60, height = radius + 2 * margin;
  std::vector<btSoftBody*> all{balls.add(height, pressure)};
  const double volume = static_cast<double>(all[0]->getVolume());
  btRigidBody* box = nullptr;
  if (carries_box) {
    box = balls.w.add(
        std::make_unique<btBoxShape>(btVector3(btScalar(0.2), btScalar(0.05), btScalar(0.2))),
        btVector3(0, static_cast<btScalar>(height + radius + 0.1), 0), 1);
    box->setAngularFactor(0);
    box->setLinearFactor(btVector3(0, 1, 0));
  } else {
    all.push_back(balls.add(3 * height, pressure));
  }
  // Without a stop they roll off each other.
  balls.w.steps(60, 1.0 / 60);
  for (const btSoftBody* const ball : all) {
    CHECK(static_cast<double>(ball->getVolume()) > 0.9 * volume);
    CHECK(strain(*ball) < 1.6);
  }
  if (box) CHECK(static_cast<double>(box->getCenterOfMassPosition().y()) > 1.6 * radius);
}

TEST_CASE("a ball with pressure on the triangles of a mesh needs few sweeps at rest") {
  const bool on_cloth = GENERATE(false, true);
  CAPTURE(on_cloth);
  const std::unique_ptr<btTriangleMesh> mesh = flat_triangles(40, 4);
  Balls balls;
  balls.w.add(std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true), btVector3(0, 0, 0));
  if (on_cloth) balls.w.add_sheet(21, 2, 0.05, 0);
  balls.add(radius + 0.1, 20);
  balls.w.steps(120, 1.0 / 60);
  const std::int64_t before = balls.w.total().sweeps;
  balls.w.steps(60, 1.0 / 60);
  CHECK(balls.w.total().sweeps - before < 60 * 100);
}

TEST_CASE("links that are solved again under load keep momentum") {
  Balls balls(0);
  btSoftBody *const lower = balls.add(0, 0), *const upper = balls.add(0.7, 0, 0.2);
  for (btSoftBody* const ball : {lower, upper}) {
    ball->m_cfg.kDP = 0;
    // Almost no force, and the links count as those of a body with pressure.
    ball->m_cfg.kVC = btScalar(1e-9);
  }
  upper->translate(btVector3(btScalar(0.1), 0, btScalar(0.05)));
  upper->setVelocity(btVector3(0, -5, 0));
  const btVector3 before = momentum(*lower) + momentum(*upper);
  balls.w.steps(20, 1.0 / 60);
  REQUIRE(balls.w.total().contacts_vf + balls.w.total().contacts_ee > 0);
  CHECK((momentum(*lower) + momentum(*upper) - before).length() < btScalar(1e-4) * before.length());
  CHECK(static_cast<double>(momentum(*lower).y()) < -0.3);
}

TEST_CASE("balls with pressure move the same on any number of threads") {
  const auto positions = [](int threads) {
    bullet::SolverOptions options;
    options.detector.threads = threads;
    Balls balls(10, options);
    balls.add_ground();
    const std::vector<btSoftBody*> all{balls.add(0.34, 60), balls.add(1.0, 30)};
    balls.w.steps(60, 1.0 / 60);
    std::vector<btVector3> found;
    for (const btSoftBody* const ball : all)
      for (int i = 0; i < ball->m_nodes.size(); ++i) found.push_back(ball->m_nodes[i].m_x);
    return found;
  };
  const std::vector<btVector3> one = positions(1);
  CHECK(one == positions(2));
  CHECK(one == positions(4));
}
