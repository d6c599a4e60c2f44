// SoftConstraints solves Bullet's own constraints with links in groups and several bodies in
// parallel. The result must be the same as Bullet's.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cfenv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <random>
#include <system_error>
#include <thread>
#include <vector>

#include "lazyccd/threads.h"
#include "links/soft_constraints.h"
#include "scenes/meshes/cloth.h"
#include "support/catch.h"

using namespace lazyccd;
using scenes::Sheet;

namespace {

constexpr btScalar dt = btScalar(1) / 60;

// A sheet that hangs from a corner. An anchor may attach a rigid body to it.
struct Hanging {
  btSoftBodyWorldInfo info;
  btBoxShape box{btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1))};
  std::unique_ptr<btRigidBody> weight;
  std::unique_ptr<btSoftBody> body;
  std::vector<int> tags;

  explicit Hanging(int nodes_z = 8) {
    info.m_gravity = btVector3(0, -10, 0);
    std::mt19937 random(7);
    Sheet sheet{9, nodes_z, 1, 1};
    sheet.jitter = 0.02;
    body = scenes::make_sheet(info, sheet, random);
    body->setMass(0, 0);
    tags.resize(static_cast<std::size_t>(body->m_links.size()));
    for (int i = 0; i < body->m_links.size(); ++i) body->m_links[i].m_tag = &tags[i];
  }

  void add_weight() {
    btVector3 inertia;
    box.calculateLocalInertia(1, inertia);
    weight = std::make_unique<btRigidBody>(1, nullptr, &box, inertia);
    weight->setWorldTransform(btTransform(btQuaternion::getIdentity(), body->m_nodes[70].m_x));
  }

  void add_anchor() {
    add_weight();
    body->appendAnchor(70, weight.get());
  }

  void add_contact(int node, const btRigidBody& with) {
    btSoftBody::RContact contact{};
    contact.m_cti.m_colObj = &with;
    contact.m_cti.m_normal = btVector3(0, 1, 0);
    contact.m_node = &body->m_nodes[node];
    contact.m_cti.m_offset = btScalar(0.01) - contact.m_node->m_x.y();
    contact.m_c0.setIdentity();
    contact.m_c1 = btVector3(btScalar(0.1), 0, 0);
    contact.m_c2 = dt;
    contact.m_c3 = btScalar(0.5);
    contact.m_c4 = 1;
    body->m_rcontacts.push_back(contact);
  }

  // Nodes and tag of each link, by which applications identify it.
  std::vector<std::array<std::ptrdiff_t, 3>> listed() const {
    std::vector<std::array<std::ptrdiff_t, 3>> links;
    for (int i = 0; i < body->m_links.size(); ++i) {
      const btSoftBody::Link& link = body->m_links[i];
      links.push_back({link.m_n[0] - &body->m_nodes[0], link.m_n[1] - &body->m_nodes[0],
                       link.m_tag ? static_cast<const int*>(link.m_tag) - tags.data() : -1});
    }
    return links;
  }

  // All positions, velocities and link constants as bytes. A NaN is replaced by one value.
  std::vector<std::array<char, sizeof(btScalar)>> state() const {
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
    constexpr btScalar none = 1e30f;  // for NaN, which has many bit patterns
    std::replace_if(
        all.begin(), all.end(), [](btScalar x) { return std::isnan(x); }, none);
    std::vector<std::array<char, sizeof(btScalar)>> bytes(all.size());
    std::memcpy(bytes.data(), all.data(), all.size() * sizeof(btScalar));
    return bytes;
  }
};

void on_caller(std::size_t count, std::size_t,
               const std::function<void(std::size_t, std::size_t)>& body) {
  body(0, count);
}

// Runs every part on a new thread, all at the same time; one after the other where there are no
// threads.
void on_own_threads(std::size_t count, std::size_t grain,
                    const std::function<void(std::size_t, std::size_t)>& body) {
  std::vector<std::exception_ptr> errors(count);
  std::vector<std::thread> threads;
  for (std::size_t first = 0; first < count; first += grain) {
    const auto run = [&, first] {
      try {
        body(first, std::min(first + grain, count));
      } catch (...) {
        errors[first] = std::current_exception();
      }
    };
    try {
      threads.emplace_back(run);
    } catch (const std::system_error&) {
      run();
    }
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::exception_ptr& error : errors)
    if (error) std::rethrow_exception(error);
}

bullet::ParallelFor on_pool(const Threads& pool) {
  return [&pool](std::size_t count, std::size_t grain, const auto& body) {
    pool.parallel_for(count, grain, body);
  };
}

// The same body twice: one is solved by Bullet, one in groups.
struct TwoBodies {
  Hanging bullets, grouped;
  bullet::SoftConstraints constraints;

  template <class Change>
  void change(const Change& change) {
    change(bullets);
    change(grouped);
  }

  template <class AddContacts>
  void step(const AddContacts& add_contacts) {
    btAlignedObjectArray<btSoftBody*> bodies;
    bodies.push_back(grouped.body.get());
    change([&](Hanging& h) {
      h.body->predictMotion(dt);
      add_contacts(h);
    });
    const auto listed = grouped.listed();
    bullets.body->solveConstraints();
    constraints.solve(bodies, on_caller);
    REQUIRE(grouped.state() == bullets.state());
    REQUIRE(grouped.listed() == listed);
  }
  void step() {
    step([](Hanging&) {});
  }
};

// While an object exists, only the first `times` allocations of Bullet succeed.
class LimitedAllocations {
 public:
  explicit LimitedAllocations(int times) {
    left = times;
    btAlignedAllocSetCustom(
        [](std::size_t size) { return left-- > 0 ? std::malloc(size) : throw std::bad_alloc(); },
        std::free);
  }
  ~LimitedAllocations() { btAlignedAllocSetCustom(nullptr, nullptr); }
  LimitedAllocations(const LimitedAllocations&) = delete;
  LimitedAllocations& operator=(const LimitedAllocations&) = delete;

 private:
  static inline int left = 0;
};

// Why the order of several bodies may matter.
enum class Dependence { none, anchors, replace_rigid_contacts, soft_contacts, links };

// SeveralBodies bodies twice: solved by Bullet one after the other, and by SoftConstraints.
struct SeveralBodies {
  std::vector<std::unique_ptr<Hanging>> bullets, grouped;
  bullet::SoftConstraints constraints;

  explicit SeveralBodies(int nodes_z = 8, int count = 5) {
    for (auto* bodies : {&bullets, &grouped}) {
      for (int i = 0; i < count; ++i) {
        bodies->push_back(std::make_unique<Hanging>(nodes_z + i % 3));
        bodies->back()->body->m_cfg.piterations = 3;
      }
    }
  }

  template <class Change>
  void change(const Change& change) {
    change(bullets);
    change(grouped);
  }

  // Predicts the motion of all. Returns the states of the grouped ones after it.
  auto predict() {
    change([](auto& all) {
      for (const auto& h : all) h->body->predictMotion(dt);
    });
    std::vector<decltype(Hanging().state())> states;
    for (const auto& h : grouped) states.push_back(h->state());
    return states;
  }
  btAlignedObjectArray<btSoftBody*> grouped_bodies() const {
    btAlignedObjectArray<btSoftBody*> bodies;
    for (const auto& h : grouped) bodies.push_back(h->body.get());
    return bodies;
  }

  // Steps both and compares them. Returns true if anything was solved in parallel.
  template <class Change>
  bool step(const bullet::ParallelFor& parallel_for, const Change& add_contacts) {
    change([&](auto& all) {
      for (const auto& h : all) h->body->predictMotion(dt);
      add_contacts(all);
    });
    const auto bodies = grouped_bodies();
    for (const auto& h : bullets)
      if (h->body->isActive()) h->body->solveConstraints();
    bool called = false;
    constraints.solve(bodies, [&](std::size_t pieces, std::size_t grain, const auto& body) {
      called = true;
      parallel_for(pieces, grain, body);
    });
    for (std::size_t i = 0; i < grouped.size(); ++i)
      REQUIRE(grouped[i]->state() == bullets[i]->state());
    return called;
  }
};

}  // namespace

TEST_CASE("solving links in groups gives bit-identical results") {
  TwoBodies both;
  const int velocities = GENERATE(0, 2), positions = GENERATE(1, 10), drift = GENERATE(0, 3);
  const bool anchored = GENERATE(false, true), twice = GENERATE(false, true);
  CAPTURE(velocities, positions, drift, anchored, twice);
  both.change([&](Hanging& h) {
    h.body->m_cfg.viterations = velocities;
    h.body->m_cfg.piterations = positions;
    h.body->m_cfg.diterations = drift;
    h.body->m_cfg.m_vsequence.push_back(btSoftBody::eVSolver::Linear);
    h.body->m_cfg.m_dsequence.push_back(btSoftBody::ePSolver::Linear);
    h.body->m_materials[0]->m_kLST = btScalar(0.7);
    if (twice) h.body->m_cfg.m_psequence.push_back(btSoftBody::ePSolver::Linear);
    if (anchored) h.add_anchor();
  });
  for (int i = 0; i < 30; ++i) both.step();
}

TEST_CASE("links may change between steps in any way") {
  TwoBodies both;
  both.change([](Hanging& h) { h.body->m_cfg.piterations = 4; });
  both.step();
  both.step();
  const int kind = GENERATE(range(0, 8));
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
      case 3:  // the same number, in another order
        body.randomizeConstraints();
        break;
      case 4:  // a link from a node to itself, and a duplicate
        body.m_links[5].m_n[1] = body.m_links[5].m_n[0];
        body.m_links[9].m_n[0] = body.m_links[8].m_n[0];
        body.m_links[9].m_n[1] = body.m_links[8].m_n[1];
        break;
      case 5:
        body.m_links[3].m_rl *= 2;
        body.setTotalMass(3);
        break;
      case 6:  // data beside the links
        for (int i = 0; i < 100; ++i) body.appendNode(btVector3(0, 1, 0), 1);
        break;
      case 7:  // all links from one node
        for (int i = 0; i < body.m_links.size(); ++i) {
          body.m_links[i].m_n[0] = &body.m_nodes[0];
          body.m_links[i].m_n[1] = &body.m_nodes[1 + i % (body.m_nodes.size() - 1)];
        }
        break;
    }
    body.updateLinkConstants();
  });
  for (int i = 0; i < 5; ++i) both.step();
}

TEST_CASE("nodes may be freed and pinned and links left out between steps") {
  TwoBodies both;
  both.change([](Hanging& h) { h.body->m_cfg.piterations = 4; });
  for (int i = 0; i < 12; ++i) {
    both.change([&](Hanging& h) {
      btSoftBody& body = *h.body;
      for (const int node : {0, 1, 9, 10}) body.setMass(node, i % 3 == 1 ? 0 : btScalar(0.1));
      // Bullet uses the links' constants, even if the masses have changed since.
      if (i % 2 == 0) body.updateLinkConstants();
      body.m_materials[0]->m_kLST = i > 8 ? 0 : 1;
    });
    both.step();
  }
}

TEST_CASE("other constraints are solved between the links in Bullet's sequence") {
  using Solver = btSoftBody::ePSolver;
  const std::vector<Solver::_> sequence = GENERATE(
      std::vector<Solver::_>{}, std::vector<Solver::_>{Solver::Anchors},
      std::vector<Solver::_>{Solver::Linear, Solver::RContacts, Solver::Anchors},
      std::vector<Solver::_>{Solver::Linear, Solver::Linear, Solver::SContacts},
      std::vector<Solver::_>{Solver::RContacts, Solver::Linear, Solver::RContacts, Solver::Linear});
  const bool anchored = GENERATE(false, true), touching = GENERATE(false, true);
  const int positions = GENERATE(0, 1, 5);
  CAPTURE(sequence.size(), anchored, touching, positions);
  TwoBodies both;
  both.change([&](Hanging& h) {
    btSoftBody::Config& config = h.body->m_cfg;
    config.piterations = positions;
    config.m_psequence.resize(0);
    for (const Solver::_ solver : sequence) config.m_psequence.push_back(solver);
    h.add_weight();
    if (anchored) h.body->appendAnchor(70, h.weight.get());
  });
  for (int i = 0; i < 10; ++i) {
    both.step([&](Hanging& h) {
      if (!touching) return;
      for (const int node : {40, 41, 70, 40}) h.add_contact(node, *h.weight);
    });
  }
}

// Makes one random change, as an application may between steps.
void change_somehow(Hanging& h, std::mt19937& random) {
  const auto below = [&](int end) {
    return static_cast<int>(random() % static_cast<unsigned>(end));
  };
  btSoftBody& body = *h.body;
  const int nodes = body.m_nodes.size(), links = body.m_links.size(), node = below(nodes);
  btSoftBody::Link* const link = links > 0 ? &body.m_links[below(links)] : nullptr;
  switch (below(12)) {
    case 0:
      body.setMass(node, below(2) ? 0 : btScalar(0.1));
      break;
    case 1:
      body.updateLinkConstants();
      break;
    case 2:
      body.m_materials[0]->m_kLST = btScalar(below(4)) / 3;
      break;
    case 3:
      body.appendNode(body.m_nodes[node].m_x * btScalar(1.01), btScalar(below(3)));
      break;
    case 4:
      for (int i = 0; i < 20; ++i)
        body.appendLink(below(nodes), below(2) ? node : below(nodes), body.m_materials[0]);
      break;
    case 5:
      body.randomizeConstraints();
      break;
    case 6:
      if (link) link->m_n[below(2)] = &body.m_nodes[node];
      break;
    case 7:
      if (link) body.m_links.resize(links - 1 - below(std::min(links, 30)));
      break;
    case 8:
      h.body->appendAnchor(node, h.weight.get());
      break;
    case 9:
      body.m_cfg.piterations = below(9);
      body.m_cfg.viterations = below(2);
      break;
    case 10:
      body.m_cfg.kDP = btScalar(below(3)) / 10;
      body.m_cfg.diterations = below(8) == 0;
      break;
    default:
      body.generateBendingConstraints(2);
  }
}

TEST_CASE("results are the same whatever happens to a body between steps") {
  for (unsigned scene = 0; scene < 60; ++scene) {
    CAPTURE(scene);
    TwoBodies both;
    both.change([&](Hanging& h) {
      h.body->m_cfg.m_vsequence.push_back(btSoftBody::eVSolver::Linear);
      h.body->m_cfg.m_dsequence.push_back(btSoftBody::ePSolver::Linear);
      h.add_weight();
    });
    std::mt19937 contacts(scene), of[2] = {std::mt19937(scene), std::mt19937(scene)};
    for (int step = 0; step < 15; ++step) {
      both.change([&](Hanging& h) { change_somehow(h, of[&h == &both.grouped]); });
      const unsigned touching = contacts() % 60;
      both.step([&](Hanging& h) {
        for (unsigned i = 0; i < touching; ++i)
          h.add_contact(static_cast<int>(7 * i % 70), *h.weight);
      });
    }
  }
}

TEST_CASE("links are solved in groups or by Bullet if each depends on the one before") {
  if (!bullet::best_link_kernels()) return;
  Hanging sheet(30);
  sheet.body->predictMotion(dt);
  bullet::BodyLinks links;
  btSoftBody* const body = sheet.body.get();
  CHECK(links.prepare({&body, 1}, 1));
  CHECK(links.prepare({&body, 1}, 10));
  CHECK(!links.prepare({&body, 1}, 0));
  // In a star each link depends on the one before, in any order.
  for (int i = 0; i < sheet.body->m_links.size(); ++i) {
    sheet.body->m_links[i].m_n[0] = &sheet.body->m_nodes[0];
    sheet.body->m_links[i].m_n[1] = &sheet.body->m_nodes[1 + i % 200];
  }
  CHECK(!links.prepare({&body, 1}, 1));
}

TEST_CASE("links of several bodies are solved in the same groups") {
  if (!bullet::best_link_kernels()) return;
  SeveralBodies several(2, 5);
  bullet::BodyLinks links;
  std::vector<btSoftBody*> bodies;
  for (const auto& h : several.grouped) bodies.push_back(h->body.get());
  for (int step = 0; step < 6; ++step) {
    CAPTURE(step);
    several.change([&](auto& all) {
      for (const auto& h : all) {
        h->body->m_cfg.piterations = 0;
        h->body->predictMotion(dt);
        h->body->solveConstraints();
      }
      if (step == 2) all[3]->body->randomizeConstraints();  // the plan no longer fits
      if (step == 3) all[1]->body->m_links[5].m_c0 = 0;     // Bullet leaves this link out
      if (step == 4) all[2]->body->m_nodes[4].m_x.setX(std::numeric_limits<btScalar>::quiet_NaN());
    });
    REQUIRE(links.prepare({bodies.data(), bodies.size()}, 5));
    links.read();
    links.solve(5);
    links.write();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      for (int pass = 0; pass < 5; ++pass)
        btSoftBody::getSolver(btSoftBody::ePSolver::Linear)(several.bullets[i]->body.get(), 1, 0);
      REQUIRE(several.grouped[i]->state() == several.bullets[i]->state());
    }
  }
  bodies[2] = several.bullets[2]->body.get();  // another member
  CHECK(links.prepare({bodies.data(), bodies.size()}, 5));
}

TEST_CASE("a link to another body's node is solved where the body lists it") {
  TwoBodies both;
  Hanging others[2];
  both.change([&](Hanging& h) {
    h.body->m_cfg.piterations = 4;
    Hanging& other = others[&h == &both.grouped];
    h.body->m_links[50].m_n[1] = &other.body->m_nodes[20];
    h.body->updateLinkConstants();
  });
  for (int i = 0; i < 5; ++i) {
    btAlignedObjectArray<btSoftBody*> bodies;
    bodies.push_back(both.grouped.body.get());
    both.bullets.body->solveConstraints();
    both.constraints.solve(bodies, on_caller);
    CHECK(both.grouped.state() == both.bullets.state());
    CHECK(others[1].state() == others[0].state());
  }
}

TEST_CASE("bodies may come and go and sleep with links of their own") {
  std::vector<std::unique_ptr<TwoBodies>> pairs;
  bullet::SoftConstraints constraints;
  for (int i = 0; i < 3; ++i) {
    pairs.push_back(std::make_unique<TwoBodies>());
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
      bodies.push_back(pair->grouped.body.get());
    }
    pairs[0]->grouped.body->forceActivationState(sleeps ? ISLAND_SLEEPING : ACTIVE_TAG);
    constraints.solve(bodies, step % 2 ? on_own_threads : on_caller);
    for (const auto& pair : pairs) {
      if (!sleeps || pair != pairs[0]) pair->bullets.body->solveConstraints();
      REQUIRE(pair->grouped.state() == pair->bullets.state());
    }
  }
}

TEST_CASE("bodies in parallel and one after the other have the same results") {
  const Dependence dependence =
      GENERATE(Dependence::none, Dependence::anchors, Dependence::replace_rigid_contacts,
               Dependence::soft_contacts, Dependence::links);
  const int threads = GENERATE(0, 1, 2, 3, 4);
  const int passes = GENERATE(3, 60);
  CAPTURE(static_cast<int>(dependence), threads, passes);
  const Threads pool(threads);
  const bullet::ParallelFor parallel_for = threads == 0 ? on_own_threads : on_pool(pool);
  SeveralBodies several;
  several.change([&](auto& bodies) {
    for (const auto& h : bodies) h->body->m_cfg.piterations = passes;
    // If two bodies push the same rigid one, or one refers to a node of another, the order matters.
    if (dependence == Dependence::anchors) {
      bodies[1]->add_anchor();
      bodies[3]->body->appendAnchor(65, bodies[1]->weight.get());
    }
    if (dependence == Dependence::replace_rigid_contacts) bodies[0]->add_weight();
    if (dependence == Dependence::links) {
      bodies[1]->body->m_links[50].m_n[1] = &bodies[2]->body->m_nodes[20];
      bodies[1]->body->updateLinkConstants();
    }
  });
  const auto add_contacts = [&](auto& bodies) {
    if (dependence == Dependence::replace_rigid_contacts) {
      for (const int i : {2, 4}) bodies[i]->add_contact(40, *bodies[0]->weight);
    }
    if (dependence == Dependence::soft_contacts) {
      btSoftBody::SContact contact{};
      contact.m_node = &bodies[3]->body->m_nodes[40];
      contact.m_face = &bodies[1]->body->m_faces[30];
      contact.m_weights = btVector3(1, 1, 1) / 3;
      contact.m_normal = btVector3(0, 1, 0);
      contact.m_margin = btScalar(0.01);
      contact.m_friction = btScalar(0.3);
      contact.m_cfm[0] = contact.m_cfm[1] = btScalar(0.5);
      bodies[3]->body->m_scontacts.push_back(contact);
    }
  };
  for (int i = 0; i < 10; ++i) {
    const bool called = several.step(parallel_for, add_contacts);
    REQUIRE(called == (dependence != Dependence::soft_contacts && dependence != Dependence::links));
  }
}

TEST_CASE("a body beside bodies that push rigid ones is solved without another thread") {
  SeveralBodies several;
  several.change([](auto& bodies) {
    for (std::size_t i = 0; i < bodies.size(); ++i)
      if (i != 2) bodies[i]->add_anchor();
  });
  for (int i = 0; i < 3; ++i) CHECK(!several.step(on_own_threads, [](auto&) {}));
}

TEST_CASE("bodies are solved in parallel with the rounding mode of the caller") {
  const Threads pool(4);
  if (pool.is_caller_only()) {
    WARN("skipped: there are no threads");
    return;
  }
  const std::thread::id caller = std::this_thread::get_id();
  std::atomic<bool> any_other{false};
  const bullet::ParallelFor parallel_for = [&](std::size_t count, std::size_t grain,
                                               const auto& body) {
    pool.parallel_for(count, grain, [&](std::size_t first, std::size_t last) {
      if (std::this_thread::get_id() != caller) any_other = true;
      body(first, last);
    });
  };
  SeveralBodies several;
  several.change([](auto& bodies) {  // enough work to wake a thread
    for (const auto& h : bodies) h->body->m_cfg.piterations = 100;
  });
  std::fesetround(FE_UPWARD);
  for (int i = 0; i < 200 && !(any_other && i > 4); ++i)
    CHECK(several.step(parallel_for, [](auto&) {}));
  std::fesetround(FE_TONEAREST);
  CHECK(any_other);
}

TEST_CASE("if a part throws each body is either solved or unchanged") {
  SeveralBodies several;
  const auto none = [](auto&) {};
  several.step(on_own_threads, none);
  const auto before = several.predict();
  const auto bodies = several.grouped_bodies();
  const auto fails = [](std::size_t count, std::size_t, const auto& body) {
    on_own_threads(count, 1, [&](std::size_t first, std::size_t last) {
      if (first == 1) throw std::bad_alloc();
      body(first, last);
    });
  };
  CHECK_THROWS_AS(several.constraints.solve(bodies, fails), std::bad_alloc);
  for (const auto& h : several.bullets) h->body->solveConstraints();
  std::size_t solved = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const bool is_solved = several.grouped[i]->state() == several.bullets[i]->state();
    solved += is_solved;
    if (is_solved) continue;
    CHECK(several.grouped[i]->state() == before[i]);
    several.grouped[i]->body->solveConstraints();
  }
  CHECK(solved > 0);
  CHECK(solved < before.size());
  several.step(on_own_threads, none);
}

TEST_CASE("small bodies that are solved together have the results of one after the other") {
  const int threads = GENERATE(0, 1, 3);
  CAPTURE(threads);
  const Threads pool(std::max(threads, 1));
  const bullet::ParallelFor parallel_for = threads == 0 ? on_own_threads : on_pool(pool);
  SeveralBodies several(2, 30);
  several.change([](auto& bodies) {
    for (std::size_t i = 0; i < bodies.size(); ++i)
      bodies[i]->body->m_cfg.piterations = i < 12 ? 3 : i % 10 == 0 ? 1 : 5;
    bodies.push_back(std::make_unique<Hanging>(9));  // a large one among them
    std::swap(bodies[5], bodies.back());
  });
  const auto none = [](auto&) {};
  for (int step = 0; step < 12; ++step) {
    CAPTURE(step);
    several.change([&](auto& bodies) {
      bodies[9]->body->forceActivationState(step % 3 == 1 ? ISLAND_SLEEPING : ACTIVE_TAG);
      if (step == 4) bodies[7]->body->m_links.resize(10);
      if (step == 6) bodies.erase(bodies.begin() + 3);
      if (step == 8) bodies[2]->body->generateBendingConstraints(2);
    });
    several.step(parallel_for, none);
    for (const int body : {0, 5, 9, 20}) {
      const int iterations = 1 + step % 3;
      btSoftBody::tNodeArray& nodes = several.grouped[body]->body->m_nodes;
      std::vector<btVector3> positions;
      for (int i = 0; i < nodes.size(); ++i) positions.push_back(nodes[i].m_x);
      for (int i = 0; i < iterations; ++i) {
        const auto before = several.grouped[body]->state();
        several.constraints.solve_links_again(*several.grouped[body]->body, body, positions);
        REQUIRE(several.grouped[body]->state() == before);
        btSoftBody::getSolver(btSoftBody::ePSolver::Linear)(several.bullets[body]->body.get(), 1,
                                                            0);
      }
      for (int i = 0; i < nodes.size(); ++i) nodes[i].m_x = positions[static_cast<std::size_t>(i)];
      REQUIRE(several.grouped[body]->state() == several.bullets[body]->state());
    }
  }
}

TEST_CASE("if a solver throws each of the bodies that are solved together is solved or unchanged") {
  int some = 0;
  bool all = false;
  for (int times = 0; !all && times < 300; ++times) {
    CAPTURE(times);
    SeveralBodies several(2, 6);
    const auto before = several.predict();
    const auto bodies = several.grouped_bodies();
    try {
      const LimitedAllocations rationed(times);
      several.constraints.solve(bodies, on_caller);
      all = true;
    } catch (const std::bad_alloc&) {
    }
    for (const auto& h : several.bullets) h->body->solveConstraints();
    std::size_t solved = 0, unchanged = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      CHECK(several.grouped[i]->body->m_cfg.piterations == 3);
      solved += several.grouped[i]->state() == several.bullets[i]->state();
      unchanged += several.grouped[i]->state() == before[i];
    }
    CHECK(solved + unchanged >= before.size() - 1);  // the one whose solver throws
    if (all) CHECK(solved == before.size());
    some += solved > 0 && solved < before.size();
  }
  CHECK(all);
  CHECK(some > 0);
}

TEST_CASE("a body whose solver threw is solved by the next call") {
  const bool grouped = GENERATE(true, false);  // Bullet's own loop is faster for very few links
  const int passes = GENERATE(1, 4);
  CAPTURE(grouped, passes);
  TwoBodies both;
  btAlignedObjectArray<btSoftBody*> bodies;
  bodies.push_back(both.grouped.body.get());
  both.change([&](Hanging& h) {
    h.body->m_cfg.piterations = passes;
    if (!grouped) h.body->m_links.resize(2);
    h.body->predictMotion(dt);
  });
  both.bullets.body->solveConstraints();
  const auto solve_given = [&](int times) {
    const LimitedAllocations rationed(times);
    both.constraints.solve(bodies, on_caller);
  };
  int times = 0;
  for (bool solved = false; !solved && times < 100; ++times) {
    CAPTURE(times);
    try {
      solve_given(times);
      solved = true;
    } catch (const std::bad_alloc&) {
      REQUIRE(both.grouped.body->m_cfg.piterations == passes);
    }
  }
  CHECK(times > 1);
  CHECK(both.grouped.state() == both.bullets.state());
  both.step();
}
