// Bullet's own constraints in another order, with the same result.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <array>
#include <memory>
#include <random>
#include <vector>

#include "scenes/cloth.h"
#include "soft_constraints.h"
#include "support/catch.h"

using namespace lazyccd;
using scenes::Sheet;

namespace {

constexpr btScalar dt = btScalar(1) / 60;

// A sheet that hangs by a corner and, with an anchor, by a rigid body.
struct Hanging {
  btSoftBodyWorldInfo info;
  btBoxShape box{btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1))};
  std::unique_ptr<btRigidBody> weight;
  std::unique_ptr<btSoftBody> body;
  std::vector<int> tags;

  Hanging() {
    info.m_gravity = btVector3(0, -10, 0);
    std::mt19937 random(7);
    Sheet sheet{9, 8, 1, 1};
    sheet.jitter = 0.02;
    body = scenes::make_sheet(info, sheet, random);
    body->setMass(0, 0);
    tags.resize(static_cast<std::size_t>(body->m_links.size()));
    for (int i = 0; i < body->m_links.size(); ++i) body->m_links[i].m_tag = &tags[i];
  }

  void add_anchor() {
    btVector3 inertia;
    box.calculateLocalInertia(1, inertia);
    weight = std::make_unique<btRigidBody>(1, nullptr, &box, inertia);
    weight->setWorldTransform(btTransform(btQuaternion::getIdentity(), body->m_nodes[70].m_x));
    body->appendAnchor(70, weight.get());
  }

  // What applications know links by.
  std::vector<std::array<std::ptrdiff_t, 3>> listed() const {
    std::vector<std::array<std::ptrdiff_t, 3>> links;
    for (int i = 0; i < body->m_links.size(); ++i) {
      const btSoftBody::Link& link = body->m_links[i];
      links.push_back({link.m_n[0] - &body->m_nodes[0], link.m_n[1] - &body->m_nodes[0],
                       link.m_tag ? static_cast<const int*>(link.m_tag) - tags.data() : -1});
    }
    return links;
  }

  std::vector<btScalar> state() const {
    std::vector<btScalar> all;
    const auto add = [&](const btVector3& x) { all.insert(all.end(), {x.x(), x.y(), x.z()}); };
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      add(body->m_nodes[i].m_x);
      add(body->m_nodes[i].m_v);
      add(body->m_nodes[i].m_q);
    }
    for (int i = 0; i < body->m_links.size(); ++i) {
      const btSoftBody::Link& link = body->m_links[i];
      add(link.m_c3);
      all.insert(all.end(), {link.m_c0, link.m_c1, link.m_c2, link.m_rl});
    }
    if (weight) {
      add(weight->getLinearVelocity());
      add(weight->getAngularVelocity());
    }
    return all;
  }
};

// The same one twice: solved by Bullet, and in order.
struct Both {
  Hanging bullets, ordered;
  bullet::SoftConstraints constraints;

  template <class Change>
  void change(const Change& change) {
    change(bullets);
    change(ordered);
  }

  void step() {
    btAlignedObjectArray<btSoftBody*> bodies;
    bodies.push_back(ordered.body.get());
    change([](Hanging& h) { h.body->predictMotion(dt); });
    const auto listed = ordered.listed();
    bullets.body->solveConstraints();
    constraints.solve(bodies);
    REQUIRE(ordered.state() == bullets.state());
    REQUIRE(ordered.listed() == listed);
  }
};

}  // namespace

TEST_CASE(
    "links that are solved in another order come to the same, to the bit, and are back after it") {
  Both both;
  const int velocities = GENERATE(0, 2), positions = GENERATE(1, 10), drift = GENERATE(0, 3);
  const bool anchored = GENERATE(false, true);
  CAPTURE(velocities, positions, drift, anchored);
  both.change([&](Hanging& h) {
    h.body->m_cfg.viterations = velocities;
    h.body->m_cfg.piterations = positions;
    h.body->m_cfg.diterations = drift;
    h.body->m_cfg.m_vsequence.push_back(btSoftBody::eVSolver::Linear);
    h.body->m_cfg.m_dsequence.push_back(btSoftBody::ePSolver::Linear);
    h.body->m_materials[0]->m_kLST = btScalar(0.7);
    if (anchored) h.add_anchor();
  });
  for (int i = 0; i < 30; ++i) both.step();
}

TEST_CASE("links may change between steps in any way") {
  Both both;
  both.change([](Hanging& h) { h.body->m_cfg.piterations = 4; });
  both.step();
  both.step();
  const int kind = GENERATE(range(0, 6));
  CAPTURE(kind);
  both.change([&](Hanging& h) {
    btSoftBody& body = *h.body;
    switch (kind) {
      case 0:
        body.generateBendingConstraints(2);
        break;
      case 1:
        body.m_links.resize(100);
        break;
      case 2:
        body.m_links.resize(0);
        break;
      case 3:  // as many, in another order
        body.randomizeConstraints();
        break;
      case 4:  // from a node to itself, and the same again
        body.m_links[5].m_n[1] = body.m_links[5].m_n[0];
        body.m_links[9].m_n[0] = body.m_links[8].m_n[0];
        body.m_links[9].m_n[1] = body.m_links[8].m_n[1];
        break;
      case 5:
        body.m_links[3].m_rl *= 2;
        body.setTotalMass(3);
        break;
    }
    body.updateLinkConstants();
  });
  for (int i = 0; i < 5; ++i) both.step();
}

TEST_CASE("a link to another body's node is solved where the body lists it") {
  Both both;
  Hanging others[2];
  both.change([&](Hanging& h) {
    h.body->m_cfg.piterations = 4;
    Hanging& other = others[&h == &both.ordered];
    h.body->m_links[50].m_n[1] = &other.body->m_nodes[20];
    h.body->updateLinkConstants();
  });
  for (int i = 0; i < 5; ++i) {
    btAlignedObjectArray<btSoftBody*> bodies;
    bodies.push_back(both.ordered.body.get());
    both.bullets.body->solveConstraints();
    both.constraints.solve(bodies);
    CHECK(both.ordered.state() == both.bullets.state());
    CHECK(others[1].state() == others[0].state());
  }
}

TEST_CASE("bodies come, go and sleep, each with the order of its own links") {
  std::vector<std::unique_ptr<Both>> pairs;
  bullet::SoftConstraints constraints;
  for (int i = 0; i < 3; ++i) {
    pairs.push_back(std::make_unique<Both>());
    pairs.back()->change([i](Hanging& h) {
      h.body->m_cfg.piterations = 3;
      if (i == 1) h.body->generateBendingConstraints(2);
    });
  }
  for (int step = 0; step < 12; ++step) {
    if (step == 4) std::swap(pairs[0], pairs[1]);
    if (step == 8) pairs.erase(pairs.begin());
    const bool sleeps = step % 3 == 2;
    btAlignedObjectArray<btSoftBody*> bodies;
    for (const auto& pair : pairs) {
      pair->change([](Hanging& h) { h.body->predictMotion(dt); });
      bodies.push_back(pair->ordered.body.get());
    }
    pairs[0]->ordered.body->forceActivationState(sleeps ? ISLAND_SLEEPING : ACTIVE_TAG);
    constraints.solve(bodies);
    for (const auto& pair : pairs) {
      if (!sleeps || pair != pairs[0]) pair->bullets.body->solveConstraints();
      REQUIRE(pair->ordered.state() == pair->bullets.state());
    }
  }
}
