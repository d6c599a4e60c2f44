// Soft bodies on meshes whose edges hardly turn: their vertices alone are constrained.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

constexpr double thickness = 0.05;  // the margins of the cloth and of the terrain

double hills(double x, double z) { return 0.05 * std::sin(4 * x) * std::cos(3 * z); }
double ridges(double x, double) { return 0.1 * std::abs(std::remainder(x, 0.4)); }

// 2 m x 2 m with a triangle for each 5 cm.
template <class Height>
std::unique_ptr<btTriangleMesh> terrain(const Height& height) {
  auto mesh = std::make_unique<btTriangleMesh>();
  constexpr int quads = 40;
  const auto point = [&](int i, int j) {
    const double x = 2.0 * i / quads - 1, z = 2.0 * j / quads - 1;
    return btVector3(static_cast<btScalar>(x), static_cast<btScalar>(height(x, z)),
                     static_cast<btScalar>(z));
  };
  for (int i = 0; i < quads; ++i)
    for (int j = 0; j < quads; ++j) {
      mesh->addTriangle(point(i, j), point(i, j + 1), point(i + 1, j + 1), true);
      mesh->addTriangle(point(i, j), point(i + 1, j + 1), point(i + 1, j), true);
    }
  return mesh;
}

// The smallest height above the terrain, of nodes and the middles of links, metres. It is not
// negative if nothing passes through, but for the curvature of the hills between their vertices.
template <class Height>
double lowest(const btSoftBody& cloth, const Height& height) {
  double least = 1;
  const auto read = [&](const btVector3& x) {
    const auto at = [&x](int k) { return static_cast<double>(x[k]); };
    least = std::min(least, at(1) - height(at(0), at(2)));
  };
  for (int i = 0; i < cloth.m_nodes.size(); ++i) read(cloth.m_nodes[i].m_x);
  for (int i = 0; i < cloth.m_links.size(); ++i)
    read((cloth.m_links[i].m_n[0]->m_x + cloth.m_links[i].m_n[1]->m_x) / 2);
  return least;
}

}  // namespace

TEST_CASE("cloth on a terrain as fine as itself has few constraints and keeps its distance") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind == World::rigid);
  const auto mesh = terrain(hills);
  ObstacleWorld w(kind, 10);
  w.add(std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true), btVector3(0, 0, 0), 0, 0.04);
  const btSoftBody* const cloth = w.add_sheet(25, 1.2, 0.2, 0);
  double least = 1;
  w.steps(is_sanitized ? 30 : 240, 1.0 / 60,
          [&](int) { least = std::min(least, lowest(*cloth, hills)); });
  CHECK(least > 0.4 * thickness);
  if (!is_sanitized) CHECK(lowest(*cloth, hills) < 1.2 * thickness);
  // With all pairs it was 14 for each node.
  CHECK(w.total().contact_rows < 3 * w.total().steps * cloth->m_nodes.size());
}

TEST_CASE("cloth that is thrown at a terrain stays above it, between ridges too") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind == World::rigid);
  const bool has_ridges = GENERATE(false, true);
  const auto height = [has_ridges](double x, double z) {
    return has_ridges ? ridges(x, z) : hills(x, z);
  };
  const auto mesh = terrain(height);
  ObstacleWorld w(kind, 10);
  w.add(std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true), btVector3(0, 0, 0), 0, 0.04);
  const btSoftBody* const cloth = w.add_sheet(13, 1.2, 0.5, 30);
  double least = 1;
  w.steps(is_sanitized ? 10 : 90, 1.0 / 60,
          [&](int) { least = std::min(least, lowest(*cloth, height)); });
  CHECK(least > 0);
  CHECK(w.total().unresolved == 0);
}

// What the detector has left out makes the re-check a whole detection.
TEST_CASE("edges of a mesh are left out if they are a large part of the scene") {
  const bool is_large = GENERATE(false, true);
  ObstacleWorld w(World::rigid, 10);
  const auto mesh = is_large ? terrain(hills) : flat_triangles(8, 1);
  w.add(std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true), btVector3(0, 0, 0), 0, 0.04);
  w.add_sheet(17, 1.2, 0.12, 0);
  w.steps(60, 1.0 / 60);
  CHECK(w.total().contacts_vf > 0);
  CHECK((w.total().rechecks > 0) == !is_large);
}

TEST_CASE("a node that comes to the corner of a box keeps its distance from it") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind == World::rigid);
  ObstacleWorld w(kind, 0);
  w.add(std::make_unique<btBoxShape>(btVector3(1, 1, 1)), btVector3(-1, -1, -1), 0, 0.04);
  // One node flies at the corner; the others are behind it.
  const btVector3 at(btScalar(0.2), btScalar(0.21), btScalar(0.19));
  const btVector3 across(btScalar(0.2), btScalar(-0.2), 0);
  btSoftBody* const body =
      w.add(std::unique_ptr<btSoftBody>(btSoftBodyHelpers::CreateFromTriMesh(
                w.info(),
                std::array<btScalar, 9>{at[0], at[1], at[2], 1 + across[0], 1 + across[1], 1,
                                        1 - across[0], 1 - across[1], 1}
                    .data(),
                std::array<int, 3>{0, 1, 2}.data(), 1)),
            0.04);
  body->setVelocity(btVector3(-1, -1, -1));
  double least = 1;
  w.steps(60, 1.0 / 60, [&](int) {
    least = std::min(least, static_cast<double>(body->m_nodes[0].m_x.length()));
  });
  CHECK(least < 0.1);
  CHECK(least > 0.035);
}
