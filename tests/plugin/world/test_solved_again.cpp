// Steps that are solved again, because the response moved bodies farther than expected.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

// A fast box throws a small sheet upwards. Bending links hold a node above it that belongs to no
// face.
struct ThrownSheet {
  ObstacleWorld w{World::rigid, 0};
  btSoftBody* sheet = w.add_sheet(4, 0.1, 0, 0);

  // Obstacles are read around all soft bodies. If `other_at` is high, the thrown sheet stays in
  // that region. If it is not, the obstacles are read again and the step is solved again.
  explicit ThrownSheet(const btVector3& other_at) {
    sheet->m_cfg.piterations = 1;
    const int inner = sheet->m_nodes.size();
    sheet->appendNode(btVector3(0, btScalar(0.03), 0), 1);
    for (int i = 0; i < inner; ++i) {
      sheet->appendLink(i, inner);
      sheet->m_links[sheet->m_links.size() - 1].m_bbending = -1;
    }
    w.add_sheet(4, 0.1, 0, 0)->translate(other_at);
    const btScalar half = btScalar(0.1);
    btRigidBody* const box = w.add(std::make_unique<btBoxShape>(btVector3(half, half, half)),
                                   btVector3(0, btScalar(-0.15), 0), 100);
    box->setLinearVelocity(btVector3(0, 60, 0));
  }
};

double distance(const btVector3& a, const btVector3& b) {
  return static_cast<double>((a - b).length());
}

}  // namespace

TEST_CASE("nodes without faces start from the same place if a step is solved again") {
  ThrownSheet again(btVector3(btScalar(0.3), 0, 0)), once(btVector3(0, 3, 0));
  for (int step = 0; step < 3; ++step) {
    for (ThrownSheet* const scene : {&again, &once}) scene->w.steps(1);
    for (int i = 0; i < once.sheet->m_nodes.size(); ++i) {
      CAPTURE(step, i);
      const btSoftBody::Node &a = again.sheet->m_nodes[i], &b = once.sheet->m_nodes[i];
      CHECK(distance(a.m_x, b.m_x) < 1e-5);
      CHECK(distance(a.m_v, b.m_v) < 1e-3);
    }
  }
  CHECK(once.w.total().contacts_vf > 0);
}
