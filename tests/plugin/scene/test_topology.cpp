#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "scene/obstacles.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"
#include "scenes/meshes/solid.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// Collision flags do not count: some bodies have none, to stay out of Bullet's face trees.
scenes::WorldOptions any_flags_options(World world) {
  scenes::WorldOptions options = quiet_options(world);
  options.lazyccd.obey_collision_flags = false;
  return options;
}

}  // namespace

TEST_CASE("a body added between steps collides, and one removed does not") {
  const World world = GENERATE(World::rigid, World::deformable);
  Impact impact(quiet_options(world));
  impact.steps(6);
  auto third = sheet(*impact.world, 7, 0.8, 0.3);
  btSoftBody* added = third.get();
  throw_down(*added, 10);
  impact.world->add(std::move(third));
  impact.steps(24);
  CHECK(impact.passed() == 0);
  CHECK(scenes::nodes_below(*added, 0, 48, *impact.held) == 0);

  const auto removed = impact.world->remove(impact.held);
  throw_down(*added, 10);
  throw_down(*impact.thrown, 10);
  impact.steps(24);
  CHECK(scenes::nodes_below(*added, 0, 48, *removed) == 49);
  CHECK(impact.world->total_stats()->fallback_steps == 0);
}

TEST_CASE("a body cut between steps still collides with its new nodes") {
  const World world = GENERATE(World::rigid, World::deformable);
  Impact impact(any_flags_options(world), 5);
  impact.steps(2);
  impact.thrown->m_cfg.collisions = 0;  // Bullet's face tree may not terminate on a cut body
  const int before = impact.thrown->m_nodes.size();
  for (int i = 0; i < 5; ++i) impact.thrown->cutLink(12 + i, 13 + i, btScalar(0.5));
  const int after = impact.thrown->m_nodes.size();
  REQUIRE(after > before);
  // Bullet gives each new node a mass of 1 kg.
  for (int i = before; i < after; ++i) impact.thrown->setMass(i, btScalar(1.0 / 36));
  scenes::CrossingCounter crossings(*impact.world);
  for (int i = 0; i < 24; ++i) {
    impact.world->step();
    crossings.step(*impact.world);
  }
  CHECK(crossings.vertex_face() + crossings.edge_edge() == 0);
  CHECK(impact.passed() == 0);
  CHECK(impact.world->total_stats()->fallback_steps == 0);
}

TEST_CASE("changed faces count after topology_changed and masses at once") {
  // A node unpinned by hand, without Bullet's setMass: a pinned pair becomes a movable one.
  const World world = GENERATE(World::rigid, World::deformable);
  Impact impact(quiet_options(world), 0);
  scenes::pin(*impact.held, 0, 80);
  scenes::pin(*impact.thrown, 0, 35);
  impact.steps(2);
  for (int i = 0; i < 36; ++i) impact.thrown->m_nodes[i].m_im = 36;
  throw_down(*impact.thrown, 10);
  impact.steps(24);
  CHECK(impact.passed() == 0);
}

TEST_CASE("a rope catches on cloth and on another rope") {
  const World world = GENERATE(World::rigid, World::deformable);
  auto w = PhysicsWorld::make(any_flags_options(world));
  const auto rope = [&](const btVector3& from, const btVector3& to, double speed) {
    std::unique_ptr<btSoftBody> body(btSoftBodyHelpers::CreateRope(w->info(), from, to, 8, 0));
    body->setTotalMass(btScalar(0.5));
    throw_down(*body, speed);
    btSoftBody* added = body.get();
    w->add(std::move(body));
    added->m_cfg.collisions = 0;  // Bullet's face tree does not survive a body without faces
    return added;
  };
  btSoftBody* fixed = rope(btVector3(-1, 0, btScalar(0.05)), btVector3(1, 0, btScalar(0.05)), 0);
  scenes::pin(*fixed, 0, fixed->m_nodes.size() - 1);
  const btSoftBody* across = rope(btVector3(btScalar(0.13), btScalar(0.1), -1),
                                  btVector3(btScalar(0.13), btScalar(0.1), 1), 10);
  auto cloth = sheet(*w, 6, 1, -0.5);
  scenes::pin(*cloth, 0, 35);
  const btSoftBody* net = cloth.get();
  w->add(std::move(cloth));
  const btSoftBody* single = rope(btVector3(btScalar(-0.3), btScalar(-0.2), btScalar(-0.3)),
                                  btVector3(btScalar(0.2), btScalar(-0.2), btScalar(-0.21)), 10);
  for (int i = 0; i < 20; ++i) w->step();
  CHECK(scenes::nodes_below(*single, 0, single->m_nodes.size() - 1, *net) == 0);
  CHECK(single->m_nodes[4].m_x.y() < btScalar(-0.4));
  // The thrown rope hangs over the fixed one: its middle is still above, its ends are not.
  btScalar highest = -10;
  for (int i = 0; i < across->m_nodes.size(); ++i) {
    highest = btMax(highest, across->m_nodes[i].m_x.y());
  }
  CHECK(highest > btScalar(-0.2));
  CHECK(across->m_nodes[0].m_x.y() < btScalar(-0.3));
}

TEST_CASE("a rope collides with its links and not with its bending links") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool bends = GENERATE(false, true);  // false: an ordinary link
  CAPTURE(world == World::rigid, bends);
  auto w = PhysicsWorld::make(any_flags_options(world));
  const btVector3 corners[] = {btVector3(0, 0, 0), btVector3(1, 0, 0), btVector3(1, 0, 1)};
  auto angle = std::make_unique<btSoftBody>(&w->info(), 3, corners, nullptr);
  angle->appendMaterial();
  for (const auto& [a, b] : {std::pair{0, 1}, {1, 2}, {0, 2}}) angle->appendLink(a, b);
  angle->m_links[2].m_bbending = bends;
  scenes::pin(*angle, 0, 2);
  // The middle of the rope falls on the middle of the third side.
  const btVector3 from(btScalar(0.4), btScalar(0.1), btScalar(0.6)),
      to(btScalar(0.6), btScalar(0.1), btScalar(0.4));
  std::unique_ptr<btSoftBody> rope(btSoftBodyHelpers::CreateRope(w->info(), from, to, 0, 0));
  throw_down(*rope, 10);
  const btSoftBody* const falls = rope.get();
  for (auto* const body : {&angle, &rope}) {
    btSoftBody* const added = body->get();
    w->add(std::move(*body));
    added->m_cfg.collisions = 0;  // Bullet's face tree does not survive a body without faces
  }
  for (int i = 0; i < 12; ++i) w->step();
  CHECK((falls->m_nodes[0].m_x.y() + falls->m_nodes[1].m_x.y() < 0) == bends);
}

TEST_CASE("nodes of a body without faces or links are left alone") {
  const World world = GENERATE(World::rigid, World::deformable);
  auto w = PhysicsWorld::make(quiet_options(world));
  const std::vector<btVector3> x = {btVector3(0, 1, 0), btVector3(1, 1, 0)};
  const std::vector<btScalar> masses = {1, 1};
  auto points = std::make_unique<btSoftBody>(&w->info(), 2, x.data(), masses.data());
  points->appendMaterial();
  btSoftBody* loose = points.get();
  w->add(std::move(points));
  loose->m_cfg.collisions = 0;
  auto cloth = sheet(*w, 4, 1, 0);
  w->add(std::move(cloth));
  for (int i = 0; i < 3; ++i) w->step();
  CHECK(w->total_stats()->fallback_steps == 0);
  CHECK(w->total_stats()->steps == 3);
}

TEST_CASE("duplicate and degenerate faces are left out and logged once") {
  const World world = GENERATE(World::rigid, World::deformable);
  int messages = 0;
  scenes::WorldOptions options = any_flags_options(world);
  options.lazyccd.on_message = [&](const std::string&) { ++messages; };
  Impact impact(options);
  btSoftBody& thrown = *impact.thrown;
  thrown.m_cfg.collisions = 0;  // Bullet's face tree does not survive such faces
  thrown.appendFace(0, 1, 7);
  thrown.m_faces[thrown.m_faces.size() - 1].m_n[2] = &thrown.m_nodes[1];
  const btSoftBody::Face first = thrown.m_faces[0];
  const auto index = [&](int k) { return static_cast<int>(first.m_n[k] - &thrown.m_nodes[0]); };
  thrown.appendFace(index(1), index(2), index(0));
  impact.steps(24);
  CHECK(impact.passed() == 0);
  CHECK(impact.world->total_stats()->fallback_steps == 0);
  CHECK(messages == 1);
  CHECK(
      impact.world->status().find("soft body 1: left out 1 faces with a repeated node, 1 duplicate "
                                  "faces") != std::string::npos);
}

TEST_CASE("nodes without faces and links are logged once") {
  const World world = GENERATE(World::rigid, World::deformable);
  int messages = 0;
  scenes::WorldOptions options = any_flags_options(world);
  options.lazyccd.on_message = [&](const std::string&) { ++messages; };
  Impact impact(options);
  for (int i = 0; i < 3; ++i) impact.world->step();
  CHECK(messages == 0);
  for (int i = 0; i < 2; ++i) {
    impact.thrown->appendNode(btVector3(0, 3, 0), btScalar(0.01));
    impact.world->step();
  }
  CHECK(messages == 1);
  CHECK(impact.world->status().find(
            "soft body 1: nodes that belong to no face, link or tetrahedron") != std::string::npos);
}

TEST_CASE("Bullet terminates for a body of several components") {
  // Bullet's own face tree would never terminate.
  const World world = GENERATE(World::rigid, World::deformable);
  scenes::WorldOptions options = quiet_options(world);
  auto w = PhysicsWorld::make(options);
  const std::vector<btVector3> points = {btVector3(0, 0, 0), btVector3(1, 0, 0),
                                         btVector3(0, 0, 1), btVector3(0, 1, 0),
                                         btVector3(1, 1, 0), btVector3(0, 1, 1)};
  auto body = std::make_unique<btSoftBody>(&w->info(), 6, points.data(), nullptr);
  body->appendMaterial();
  for (const int first : {0, 3}) {
    body->appendFace(first, first + 1, first + 2);
    for (int k = 0; k < 3; ++k) body->appendLink(first + k, first + (k + 1) % 3);
  }
  btSoftBody* const parts = body.get();
  w->add(std::move(body));
  const int collisions = parts->m_cfg.collisions;
  for (int i = 0; i < 3; ++i) w->step();
  CHECK(parts->m_cfg.collisions == collisions);
  CHECK(parts->m_nodes[0].m_x == points[0]);
}

TEST_CASE("the search distance is the largest sum of margins of two bodies that may collide") {
  ObstacleWorld w(World::deformable, 0);
  btSoftBody* const thin = w.add_sheet(3, 1, 0, 0);
  w.add(std::make_unique<btSphereShape>(btScalar(0.3)), btVector3(0, -1, 0));
  btAlignedObjectArray<btSoftBody*> bodies;
  bodies.push_back(thin);
  bullet::WarningLog warnings({});
  const auto largest_margins = [&] {
    bullet::SoftScene scene{bullet::CollisionFlags(true)};
    bullet::Sleepers sleepers;
    sleepers.begin_step(bodies);
    sleepers.find_members(bodies);
    scene.update(sleepers, warnings);
    bullet::Obstacles obstacles(5);
    obstacles.begin_step(bodies);
    const btVector3 far(2, 2, 2);
    obstacles.read_poses(bodies, 1, warnings);
    if (obstacles.update(bodies, {{-far, far}}, 0.005, warnings))
      obstacles.read_triangles({}, warnings);
    REQUIRE(obstacles.records().size() == 1);
    bullet::StepTopology topology;
    topology.update(scene, obstacles, true);
    return topology.largest_margins();
  };
  const double margin = static_cast<double>(btScalar(0.01));
  // The sphere's margin is its radius, and its triangles lie at this radius, so it adds nothing.
  CHECK(largest_margins() == margin);
  thin->setSelfCollision(true);
  CHECK(largest_margins() == 2 * margin);
  btSoftBody* const thick =
      w.add(scenes::make_rope(w.info(), 3, 1, btVector3(0, 1, 0), btVector3(1, 1, 0)), 0.04);
  bodies.push_back(thick);
  CHECK(largest_margins() == margin + static_cast<double>(btScalar(0.04)));
  thick->setIgnoreCollisionCheck(thin, true);
  thick->m_cfg.collisions = btSoftBody::fCollision::VF_DD;
  CHECK(largest_margins() == 2 * margin);
}
