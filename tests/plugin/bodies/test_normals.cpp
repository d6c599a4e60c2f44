// Normals that are computed on several threads have the bits of Bullet's.
#include "bodies/normals.h"
#include "lazyccd/threads.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/solid.h"
#include "support/catch.h"

using namespace lazyccd;

namespace {

struct Bodies {
  btSoftBodyWorldInfo info;
  std::vector<std::unique_ptr<btSoftBody>> owned;
  btAlignedObjectArray<btSoftBody*> all;

  Bodies() {
    std::mt19937 random(5);
    for (int i = 0; i < 3; ++i) {
      scenes::Sheet s{40 + 9 * i, 30, 1, 1};
      s.jitter = 0.01;
      owned.push_back(scenes::make_sheet(info, s, random));
    }
    owned.push_back(scenes::make_ball(info, 3, 1, btVector3(0, 0, 0), 1));
    owned.push_back(scenes::make_rope(info, 9, 1, btVector3(0, 0, 0), btVector3(1, 0, 0)));
    btSoftBody::Node* const node = &owned[0]->m_nodes[0];
    for (btSoftBody::Node*& corner : owned[0]->m_faces[3].m_n) corner = node;  // without a normal
    for (const auto& body : owned) all.push_back(body.get());
  }
  std::vector<btScalar> normals() const {
    std::vector<btScalar> found;
    const auto add = [&](const btVector3& n) { found.insert(found.end(), {n.x(), n.y(), n.z()}); };
    for (const auto& body : owned) {
      for (int i = 0; i < body->m_nodes.size(); ++i) add(body->m_nodes[i].m_n);
      for (int i = 0; i < body->m_faces.size(); ++i) add(body->m_faces[i].m_normal);
    }
    return found;
  }
};

}  // namespace

TEST_CASE("normals have the bits of Bullet's on any number of threads") {
  const int threads = GENERATE(1, 2, 3);
  CAPTURE(threads);
  const Threads pool(threads);
  Bodies bullets, ours;
  bullet::Normals normals;
  for (int round = 0; round < 6; ++round) {
    CAPTURE(round);
    for (Bodies* bodies : {&bullets, &ours}) {
      btSoftBody& first = *bodies->owned[0];
      first.m_nodes[50].m_x += btVector3(0, btScalar(0.01), 0);
      if (round == 1) std::swap(first.m_faces[5].m_n[0], first.m_faces[5].m_n[1]);
      if (round == 2) first.appendFace(0, 70, 90);
      if (round == 3) bodies->owned[1]->forceActivationState(ISLAND_SLEEPING);
      if (round == 4) first.m_faces[8].m_n[2] = &bodies->owned[2]->m_nodes[4];
      if (round == 5) bodies->owned[1]->forceActivationState(ACTIVE_TAG);
    }
    for (const auto& body : bullets.owned)
      if (body->isActive()) body->updateNormals();
    normals.update(ours.all, [&](std::size_t count, std::size_t grain, const auto& body) {
      pool.parallel_for(count, grain, body);
    });
    REQUIRE(ours.normals() == bullets.normals());
  }
}
