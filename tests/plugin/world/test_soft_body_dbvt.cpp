// Bullet's trees of nodes and faces are built only when Bullet reads them.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

// A sheet sinks towards a box. Bullet or LazyCCD handles their contacts.
struct Sinking {
  ObstacleWorld w;
  btSoftBody* sheet;

  explicit Sinking(bool bullets_contacts, double height = 0.5)
      : w(World::deformable, 0, options(bullets_contacts)), sheet(w.add_sheet(6, 1, height, 1)) {
    sheet->m_cfg.collisions |= btSoftBody::fCollision::SDF_RDF;
    w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.4), 1)), btVector3(0, 0, 0));
  }

  static bullet::SolverOptions options(bool bullets_contacts) {
    bullet::SolverOptions options;
    options.replace_rigid_contacts = !bullets_contacts;
    return options;
  }
};

bool holds(const btDbvtVolume& volume, const btVector3& point) {
  return volume.Contain(btDbvtVolume::FromMM(point, point));
}

}  // namespace

TEST_CASE("trees that Bullet reads have the positions of that step") {
  Sinking s(true);
  s.w.steps(12);
  std::vector<btVector3> start;
  for (int i = 0; i < s.sheet->m_nodes.size(); ++i) start.push_back(s.sheet->m_nodes[i].m_x);
  s.w.steps(1);
  REQUIRE_FALSE(s.sheet->m_fdbvt.empty());
  for (int i = 0; i < s.sheet->m_nodes.size(); ++i) {
    CHECK(holds(s.sheet->m_nodes[i].m_leaf->volume, start[i]));
    CHECK(holds(s.sheet->m_ndbvt.m_root->volume, start[i]));
    CHECK(holds(s.sheet->m_fdbvt.m_root->volume, start[i]));
  }
  // Bullet's own contacts hold the sheet.
  s.w.steps(60);
  for (int i = 0; i < s.sheet->m_nodes.size(); ++i)
    CHECK(s.sheet->m_nodes[i].m_x.y() > btScalar(0.39));
}

TEST_CASE("a body that was removed and added again has the face tree that Bullet reads") {
  Sinking s(true, 1);
  auto& world = static_cast<btDeformableMultiBodyDynamicsWorld&>(s.w.world());
  s.w.steps(1);
  REQUIRE(s.sheet->m_fdbvt.empty());  // nothing has read it yet
  world.removeSoftBody(s.sheet);
  s.w.steps(1);
  world.addSoftBody(s.sheet);
  s.w.steps(180);
  CHECK_FALSE(s.sheet->m_fdbvt.empty());
  for (int i = 0; i < s.sheet->m_nodes.size(); ++i)
    CHECK(s.sheet->m_nodes[i].m_x.y() > btScalar(0.39));
}

TEST_CASE("a body that moves to another world has the face tree that Bullet reads there") {
  Sinking from(true, 1), to(true, 1);
  auto& old_world = static_cast<btDeformableMultiBodyDynamicsWorld&>(from.w.world());
  auto& new_world = static_cast<btDeformableMultiBodyDynamicsWorld&>(to.w.world());
  from.w.steps(1);
  to.w.steps(1);
  REQUIRE(from.sheet->m_fdbvt.empty());  // nothing has read it yet
  old_world.removeSoftBody(from.sheet);
  new_world.removeSoftBody(to.sheet);
  from.sheet->m_worldInfo = &to.w.info();
  new_world.addSoftBody(from.sheet);
  to.w.steps(180);
  CHECK_FALSE(from.sheet->m_fdbvt.empty());
  for (int i = 0; i < from.sheet->m_nodes.size(); ++i)
    CHECK(from.sheet->m_nodes[i].m_x.y() > btScalar(0.39));
  new_world.removeSoftBody(from.sheet);
}

TEST_CASE("no face tree is built if Bullet reads none") {
  Sinking s(false);
  s.w.steps(60);
  CHECK(s.w.total().contacts_vf > 0);
  CHECK(s.sheet->m_fdbvt.empty());
  CHECK((s.sheet->m_cfg.collisions & btSoftBody::fCollision::SDF_RD) != 0);
  // If an application uses a face tree, Bullet builds it and LazyCCD keeps it up to date.
  btSoftBody::sRayCast hit;
  CHECK(s.sheet->rayTest(btVector3(0, 1, 0), btVector3(0, -1, 0), hit));
  s.sheet->translate(btVector3(0, 1, 3));
  s.w.steps(1);
  REQUIRE_FALSE(s.sheet->m_fdbvt.empty());
  CHECK(s.sheet->rayTest(btVector3(0, 2, 3), btVector3(0, -1, 3), hit));
}

TEST_CASE("the tree of nodes is complete after Bullet rebuilds both trees") {
  ObstacleWorld w(World::deformable, 0);
  btSoftBody* sheet = w.add_sheet(6, 1, 0.5, 0);
  w.steps(1);
  btSoftBody::sRayCast hit;  // makes Bullet build a face tree, with normals
  CHECK(sheet->rayTest(btVector3(0, 1, 0), btVector3(0, -1, 0), hit));
  sheet->setMass(0, 2);  // also marks the body as changed
  w.steps(2);
  REQUIRE(sheet->m_fdbvnt != nullptr);
  CHECK(sheet->m_ndbvt.m_leaves == sheet->m_nodes.size());
  for (int i = 0; i < sheet->m_nodes.size(); ++i) {
    const btDbvtNode* top = sheet->m_nodes[i].m_leaf;
    while (top->parent) top = top->parent;
    CHECK(top == sheet->m_ndbvt.m_root);
  }
}
