// Bullet's trees over nodes and faces, which are made when Bullet reads them.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

// A sheet that sinks towards a box, whose contacts Bullet handles or LazyCCD.
struct Sinking {
  ObstacleWorld w;
  btSoftBody* sheet;

  explicit Sinking(bool bullets_contacts)
      : w(World::deformable, 0, options(bullets_contacts)), sheet(w.add_sheet(6, 1, 0.5, 1)) {
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

TEST_CASE("trees are of the step in which Bullet reads them") {
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
  // So Bullet's own contacts hold it.
  s.w.steps(60);
  for (int i = 0; i < s.sheet->m_nodes.size(); ++i)
    CHECK(s.sheet->m_nodes[i].m_x.y() > btScalar(0.39));
}

TEST_CASE("no tree of faces is built where Bullet reads none") {
  Sinking s(false);
  s.w.steps(60);
  CHECK(s.w.total().contacts_vf > 0);
  CHECK(s.sheet->m_fdbvt.empty());
  CHECK((s.sheet->m_cfg.collisions & btSoftBody::fCollision::SDF_RD) != 0);
  // Where an application asks for one, it gets it, and it is kept.
  btSoftBody::sRayCast hit;
  CHECK(s.sheet->rayTest(btVector3(0, 1, 0), btVector3(0, -1, 0), hit));
  s.sheet->translate(btVector3(0, 1, 3));
  s.w.steps(1);
  REQUIRE_FALSE(s.sheet->m_fdbvt.empty());
  CHECK(s.sheet->rayTest(btVector3(0, 2, 3), btVector3(0, -1, 3), hit));
}

TEST_CASE("the tree of nodes holds them all where Bullet builds both trees anew") {
  ObstacleWorld w(World::deformable, 0);
  btSoftBody* sheet = w.add_sheet(6, 1, 0.5, 0);
  w.steps(1);
  btSoftBody::sRayCast hit;  // which has Bullet build one of faces, with normals
  CHECK(sheet->rayTest(btVector3(0, 1, 0), btVector3(0, -1, 0), hit));
  sheet->setMass(0, 2);  // and marks the body as changed
  w.steps(2);
  REQUIRE(sheet->m_fdbvnt != nullptr);
  CHECK(sheet->m_ndbvt.m_leaves == sheet->m_nodes.size());
  for (int i = 0; i < sheet->m_nodes.size(); ++i) {
    const btDbvtNode* top = sheet->m_nodes[i].m_leaf;
    while (top->parent) top = top->parent;
    CHECK(top == sheet->m_ndbvt.m_root);
  }
}
