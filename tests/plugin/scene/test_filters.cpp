#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <string>

#include "plugin/support/worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr int until_through = 24;  // steps at 10 m/s: 1 m

}  // namespace

TEST_CASE("a pair that no filter excludes collides") {
  const World world = GENERATE(World::rigid, World::deformable);
  Impact impact(quiet_options(world));
  impact.steps(until_through);
  CHECK(impact.passed() == 0);
  CHECK(impact.world->total_stats()->contacts_vf > 0);
}

TEST_CASE("filter masks keep a pair apart") {
  const World world = GENERATE(World::rigid, World::deformable);
  Impact impact(quiet_options(world), 10, 2, 2);  // the other sheet is in group 1
  impact.steps(until_through);
  CHECK(impact.passed() == 36);
  CHECK(impact.world->total_stats()->contacts_vf == 0);
}

TEST_CASE("a pair set to ignore each other does so from then on") {
  using Flag = btSoftBody::fCollision;
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string by = GENERATE("list", "check", "group", "mask", "clusters");
  CAPTURE(world == World::rigid, by);
  Impact impact(quiet_options(world));
  impact.steps(8);  // in contact
  REQUIRE(impact.world->total_stats()->contacts_vf > 0);
  REQUIRE(impact.passed() == 0);
  btBroadphaseProxy& proxy = *impact.thrown->getBroadphaseHandle();
  if (by == "list") impact.held->m_collisionDisabledObjects.push_back(impact.thrown);
  if (by == "check") impact.thrown->setIgnoreCollisionCheck(impact.held, true);
  if (by == "group") proxy.m_collisionFilterGroup = 0;
  if (by == "mask") proxy.m_collisionFilterMask = 0;
  for (btSoftBody* const body : {impact.held, impact.thrown})
    if (by == "clusters") body->m_cfg.collisions = Flag::SDF_RS | Flag::CL_SS;  // has none
  throw_down(*impact.thrown, 10);
  impact.steps(until_through);
  CHECK(impact.passed() == 36);
}

TEST_CASE("bodies that overlap cost no detection until their flags ask for contact") {
  using Flag = btSoftBody::fCollision;
  const World world = GENERATE(World::rigid, World::deformable);
  const int none = GENERATE(0, Flag::SDF_RS);  // SDF_RS: with rigid bodies, of which there are none
  CAPTURE(world == World::rigid, none);
  Impact impact(quiet_options(world), 1);
  const int asked = impact.held->m_cfg.collisions;
  for (btSoftBody* const body : {impact.held, impact.thrown}) body->m_cfg.collisions = none;
  impact.steps(8);
  CHECK(impact.world->total_stats()->detections == 0);
  CHECK(impact.world->total_stats()->fallback_steps == 0);
  for (btSoftBody* const body : {impact.held, impact.thrown}) body->m_cfg.collisions = asked;
  throw_down(*impact.thrown, 10);
  impact.steps(until_through);
  CHECK(impact.world->total_stats()->contacts_vf > 0);
  CHECK(impact.passed() == 0);
}

TEST_CASE("faces and links that an application removes do not collide from then on") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool has_faces = GENERATE(false, true);  // false: a net
  CAPTURE(world == World::rigid, has_faces);
  Impact impact(quiet_options(world));
  btSoftBody& held = *impact.held;
  (has_faces ? held.m_links.resize(0) : held.m_faces.resize(0));
  impact.steps(8);
  REQUIRE(impact.world->total_stats()->contacts_vf + impact.world->total_stats()->contacts_ee > 0);
  REQUIRE(impact.passed() == 0);
  (has_faces ? held.m_faces.resize(0) : held.m_links.resize(0));
  throw_down(*impact.thrown, 10);
  impact.steps(until_through);
  CHECK(impact.world->contacts().size() == 0);
  for (int i = 0; i < impact.thrown->m_nodes.size(); ++i)
    CHECK(impact.thrown->m_nodes[i].m_x.y() < btScalar(-0.1));
}

TEST_CASE("an application's own broad phase filter decides at any time") {
  struct Filter : btOverlapFilterCallback {
    bool allow = true;
    bool needBroadphaseCollision(btBroadphaseProxy*, btBroadphaseProxy*) const override {
      return allow;
    }
  };
  const World world = GENERATE(World::rigid, World::deformable);
  Filter filter;
  Impact impact(quiet_options(world), 10, 2, 2);  // the filter replaces the masks
  impact.world->info().m_broadphase->getOverlappingPairCache()->setOverlapFilterCallback(&filter);
  impact.steps(8);
  CHECK(impact.world->total_stats()->contacts_vf > 0);
  CHECK(impact.passed() == 0);
  filter.allow = false;
  throw_down(*impact.thrown, 10);
  impact.steps(until_through);
  CHECK(impact.passed() == 36);
}

TEST_CASE("a body without contact response is reported and passes through") {
  const World world = GENERATE(World::rigid, World::deformable);
  Impact impact(quiet_options(world));
  impact.thrown->setCollisionFlags(impact.thrown->getCollisionFlags() |
                                   btCollisionObject::CF_NO_CONTACT_RESPONSE);
  std::size_t reported = 0;
  for (int i = 0; i < until_through; ++i) {
    impact.world->step();
    reported += impact.world->contacts().size();
  }
  CHECK(impact.passed() == 36);
  CHECK(reported > 0);
}

TEST_CASE("a body collides with itself only if self-collision is on") {
  // Two squares in one body, which thus has two components.
  const World world = GENERATE(World::rigid, World::deformable);
  const bool asked = GENERATE(false, true);
  auto w = PhysicsWorld::make(quiet_options(world));
  std::vector<btVector3> x;
  for (const btScalar y : {btScalar(0), btScalar(0.1)}) {
    const btScalar translation = y > 0 ? btScalar(0.31) : 0;
    for (const auto& [u, v] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
      x.push_back(btVector3(btScalar(u) + translation, y, btScalar(v) + translation));
    }
  }
  const std::vector<btScalar> masses(8, btScalar(0.1));
  auto body = std::make_unique<btSoftBody>(&w->info(), 8, x.data(), masses.data());
  body->appendMaterial();
  for (const int first : {0, 4}) {
    body->appendFace(first, first + 1, first + 2);
    body->appendFace(first + 1, first + 3, first + 2);
    for (const auto& [a, b] : {std::pair{0, 1}, {1, 3}, {3, 2}, {2, 0}, {1, 2}}) {
      body->appendLink(first + a, first + b);
    }
  }
  scenes::pin(*body, 0, 3);
  for (int i = 4; i < 8; ++i) body->m_nodes[i].m_v = btVector3(0, -5, 0);
  body->setSelfCollision(asked);
  btSoftBody* both = body.get();
  w->add(std::move(body));
  // Bullet's own face tree never terminates for a body of several components.
  both->m_cfg.collisions = 0;
  for (int i = 0; i < 24; ++i) w->step();
  CHECK((both->m_nodes[4].m_x.y() > 0) == asked);
}
