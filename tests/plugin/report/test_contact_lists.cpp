#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <cmath>
#include <memory>
#include <random>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/shapes.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

std::vector<btScalar> run(const scenes::WorldOptions& options, bool clear_lists) {
  Impact impact(options);
  for (int i = 0; i < 24; ++i) {
    impact.world->step();
    for (const auto& body : impact.world->bodies()) {
      if (!clear_lists) continue;
      body->m_scontacts.resize(0);
      body->m_faceNodeContacts.resize(0);
    }
  }
  return scenes::read_positions(*impact.world);
}

}  // namespace

TEST_CASE("applications find the vertex-face contacts of a step in Bullet's own lists") {
  const World world = GENERATE(World::rigid, World::deformable);
  Impact impact(quiet_options(world));
  int listed = 0, vertex_face = 0;
  for (int i = 0; i < 24; ++i) {
    impact.world->step();
    for (const auto& contact : impact.world->contacts()) {
      vertex_face += contact.kind == ContactKind::vertex_face;
    }
    for (const auto& body : impact.world->bodies()) {
      for (int c = 0; c < body->m_scontacts.size(); ++c) {
        const btSoftBody::SContact& contact = body->m_scontacts[c];
        CHECK_THAT(double(contact.m_normal.length()), Matchers::WithinAbs(1, 1e-5));
        const btVector3& w = contact.m_weights;
        CHECK_THAT(double(w.x() + w.y() + w.z()), Matchers::WithinAbs(1, 1e-5));
        CHECK_THAT(double(contact.m_margin), Matchers::WithinAbs(0.02, 1e-6));
        CHECK(contact.m_node >= &body->m_nodes[0]);
        CHECK(contact.m_node < &body->m_nodes[0] + body->m_nodes.size());
        ++listed;
      }
      for (int c = 0; c < body->m_faceNodeContacts.size(); ++c) {
        const btSoftBody::DeformableFaceNodeContact& contact = body->m_faceNodeContacts[c];
        CHECK_THAT(double(contact.m_normal.length()), Matchers::WithinAbs(1, 1e-5));
        CHECK(contact.m_colObj == (body.get() == impact.held ? impact.thrown : impact.held));
        ++listed;
      }
    }
  }
  CHECK(listed > 0);
  CHECK(listed == vertex_face);
}

TEST_CASE("applications find the nodes' contacts with rigid bodies in Bullet's own lists") {
  const World kind = GENERATE(World::rigid, World::deformable);
  ObstacleWorld w(kind, 10);
  const btRigidBody* const ground =
      w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.1), 1)),
            btVector3(0, btScalar(-0.1), 0));
  btSoftBody* const sheet = w.add_sheet(13, 0.8, 0.021, 0);
  int listed = 0;
  const auto check = [&](const auto& list) {
    for (int c = 0; c < list.size(); ++c, ++listed) {
      CHECK(list[c].m_cti.m_colObj == ground);
      CHECK(list[c].m_node >= &sheet->m_nodes[0]);
      CHECK(list[c].m_node < &sheet->m_nodes[0] + sheet->m_nodes.size());
      CHECK(list[c].m_cti.m_normal.y() == Approx(1));
      CHECK(list[c].m_c1.y() == Approx(0.1));  // from the centre of the ground
      CHECK(list[c].m_c3 == Approx(sheet->m_cfg.kDF * ground->getFriction()));
      CHECK(list[c].jacobianData_normal.m_jacobians.size() == 0);
    }
  };
  for (int i = 0; i < 120; ++i) {
    w.steps(1, 1.0 / 240);
    check(sheet->m_rcontacts);
    check(sheet->m_nodeRigidContacts);
  }
  CHECK(listed > 1000);
}

TEST_CASE("without fill_contact_lists Bullet's own lists are empty, and all else stays the same") {
  scenes::WorldOptions options = quiet_options(GENERATE(World::rigid, World::deformable));
  options.lazyccd.fill_contact_lists = false;
  Impact impact(options);
  std::size_t contacts = 0;
  for (int i = 0; i < 24; ++i) {
    impact.world->step();
    contacts += impact.world->contacts().size();
    for (const auto& body : impact.world->bodies()) {
      CHECK(body->m_scontacts.size() == 0);
      CHECK(body->m_rcontacts.size() == 0);
      CHECK(body->m_faceNodeContacts.size() == 0);
      CHECK(body->m_nodeRigidContacts.size() == 0);
    }
  }
  CHECK(contacts > 0);
  const std::vector<btScalar> without = scenes::read_positions(*impact.world);
  options.lazyccd.fill_contact_lists = true;
  CHECK(run(options, false) == without);
}

TEST_CASE("a deformable body's list of face contacts has those with rigid bodies, if asked for") {
  const bool asks = GENERATE(true, false);
  const auto world = scenes::PhysicsWorld::make(quiet_options(World::deformable));
  world->add_static(scenes::make_box(0.2, 0.1, 0.2), scenes::at(0, -0.1, 0));
  scenes::Sheet sheet{9, 9, 1, 1};
  sheet.height = 0.021;
  std::mt19937 random(1);
  auto made = scenes::make_sheet(world->info(), sheet, random);
  btSoftBody& cloth = *made;
  world->add(std::move(made));
  cloth.m_cfg.collisions &= ~(btSoftBody::fCollision::SDF_RDF | btSoftBody::fCollision::SDF_MDF);
  if (asks) cloth.m_cfg.collisions |= btSoftBody::fCollision::SDF_RDF;
  cloth.addVelocity(btVector3(0, -1, 0));
  std::size_t contacts = 0, listed = 0;
  for (int i = 0; i < 24; ++i) {
    world->step();
    contacts += world->contacts().size();
    listed += static_cast<std::size_t>(cloth.m_faceRigidContacts.size());
    for (int c = 0; c < cloth.m_faceRigidContacts.size(); ++c) {
      const btSoftBody::DeformableFaceRigidContact& contact = cloth.m_faceRigidContacts[c];
      CHECK(contact.m_cti.m_colObj == world->rigid_bodies()[0].body.get());
      CHECK_THAT(double(contact.m_bary.dot(btVector3(1, 1, 1))), Matchers::WithinAbs(1, 1e-5));
      CHECK(contact.m_cti.m_normal.y() > btScalar(-1e-5));
      // The point is on the cloth, near the box, and no farther than contacts are looked for.
      CHECK(std::abs(double(contact.m_contactPoint.y())) < 0.1);
      CHECK(std::abs(double(contact.m_cti.m_offset)) < 0.03);
    }
  }
  CHECK(contacts > 0);
  CHECK(listed == (asks ? contacts : 0));
}

TEST_CASE("Bullet does not act on the contacts in its lists a second time") {
  const World world = GENERATE(World::rigid, World::deformable);
  CHECK(run(quiet_options(world), true) == run(quiet_options(world), false));
}

TEST_CASE("a run is reproducible with any number of threads") {
  const World world = GENERATE(World::rigid, World::deformable);
  scenes::WorldOptions options = quiet_options(world);
  const auto first = run(options, false);
  options.lazyccd.detector.threads = 1;
  CHECK(run(options, false) == first);
  options.lazyccd.detector.threads = 3;
  CHECK(run(options, false) == first);
}

TEST_CASE("a contact's impulse pushes its two sides apart along the normal") {
  const World world = GENERATE(World::rigid, World::deformable);
  Impact impact(quiet_options(world));
  double pushed = 0;
  for (int i = 0; i < 24; ++i) {
    impact.world->step();
    for (const auto& contact : impact.world->contacts()) {
      CHECK(contact.impulse >= 0);
      pushed += contact.impulse;
      CHECK((contact.kind == ContactKind::vertex_face) == (contact.face != nullptr));
      CHECK(contact.body_a != contact.body_b);
    }
  }
  // 1 kg arrived at 10 m/s, and the lower sheet yielded.
  CHECK(pushed > 2);
}
