// Worlds that run at the same time, and bodies that applications delete in the meantime.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <array>
#include <system_error>
#include <thread>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

// Drops two sheets on a box. Returns their final positions.
std::vector<btScalar> drop(World kind) {
  ObstacleWorld w(kind, 10);
  w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.2), 1)), btVector3(0, 0, 0));
  std::vector<btScalar> ends;
  const std::array<btSoftBody*, 2> sheets = {w.add_sheet(6, 1, 0.25, 2), w.add_sheet(6, 1, 0.3, 2)};
  w.steps(40);
  for (const btSoftBody* sheet : sheets) {
    for (int i = 0; i < sheet->m_nodes.size(); ++i) {
      for (int k = 0; k < 3; ++k) ends.push_back(sheet->m_nodes[i].m_x[k]);
    }
  }
  return ends;
}

}  // namespace

TEST_CASE("worlds that step at the same time behave as each does alone") {
  const std::array<World, 4> kinds = {World::rigid, World::deformable, World::rigid,
                                      World::deformable};
  std::array<std::vector<btScalar>, 4> ends;
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    try {
      threads.emplace_back([&, i] { ends[i] = drop(kinds[i]); });
    } catch (const std::system_error&) {
      WARN("skipped: there are no threads");
      return;
    }
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < kinds.size(); ++i) CHECK(ends[i] == drop(kinds[i]));
}

TEST_CASE("soft and rigid bodies may be deleted in on_contacts") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind == World::rigid);
  bullet::SolverOptions options;
  ObstacleWorld* world = nullptr;
  std::vector<const btCollisionObject*> removed;
  options.on_contacts = [&](Span<const bullet::StepContact> contacts) {
    const std::array<btCollisionObject*, 2> bodies = {contacts[0].body_a, contacts[0].body_b};
    if (removed.size() == 2) return;
    for (btCollisionObject* body : bodies) {
      world->remove(body);
      removed.push_back(body);
    }
  };
  ObstacleWorld w(kind, 10, options);
  world = &w;
  w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.2), 1)), btVector3(0, 0, 0));
  w.add_sheet(6, 1, 0.25, 2);
  btSoftBody* const last = w.add_sheet(6, 1, 0.3, 2);
  w.steps(60);
  REQUIRE(removed.size() == 2);
  CHECK(std::count(removed.begin(), removed.end(), last) == 0);
  CHECK(last->m_nodes[0].m_x.y() < 0);  // nothing is below it any more
  CHECK(w.total().fallback_steps == 0);
}

TEST_CASE("cloth lies on the links of a multibody") {
  ObstacleWorld w(World::deformable, 10);
  auto& world = static_cast<btMultiBodyDynamicsWorld&>(w.world());
  btMultiBody body(1, 0, btVector3(0, 0, 0), true, false);
  body.setupRevolute(0, 1, btVector3(1, 1, 1), -1, btQuaternion::getIdentity(), btVector3(0, 1, 0),
                     btVector3(0, 0, 0), btVector3(0, 0, 0), true);
  body.finalizeMultiDof();
  body.setJointVel(0, 2);
  world.addMultiBody(&body);
  btBoxShape shape(btVector3(1, btScalar(0.1), 1));
  btMultiBodyLinkCollider link(&body, 0);
  link.setCollisionShape(&shape);
  body.getLink(0).m_collider = &link;
  world.addCollisionObject(&link);
  btSoftBody* const cloth = w.add_sheet(6, 1, 0.2, 1);
  w.steps(100);
  for (int i = 0; i < cloth->m_nodes.size(); ++i) CHECK(cloth->m_nodes[i].m_x.y() > btScalar(0.1));
  CHECK(body.getJointPos(0) > btScalar(0.5));
  CHECK(w.total().unresolved == 0);
  CHECK(w.total().fallback_steps == 0);
  world.removeCollisionObject(&link);
  world.removeMultiBody(&body);
}
