// Solid bodies of tetrahedra in the rigid world: links and contacts carry an impact in turn, so
// that no tetrahedra turn inside out.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <array>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/soft_body_figures.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

constexpr double side = 0.4, cube_margin = 0.02;

// A cube around the origin, of cells^3 cells with five tetrahedra each.
std::unique_ptr<btSoftBody> make_cube(btSoftBodyWorldInfo& info, int cells, double mass) {
  const int nodes = cells + 1;
  const auto at = [&](int i) { return btScalar(side * i / cells - side / 2); };
  std::vector<btVector3> places;
  for (int i = 0; i < nodes; ++i)
    for (int j = 0; j < nodes; ++j)
      for (int k = 0; k < nodes; ++k) places.emplace_back(at(i), at(j), at(k));
  auto body =
      std::make_unique<btSoftBody>(&info, static_cast<int>(places.size()), places.data(), nullptr);
  using Corners = std::array<int, 4>;
  // Neighbours are mirror images, so that their diagonals meet.
  const std::array<std::array<Corners, 5>, 2> divisions = {
      {{{{0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}, {1, 2, 4, 7}}},
       {{{1, 0, 5, 3}, {2, 3, 6, 0}, {4, 5, 0, 6}, {7, 6, 3, 5}, {0, 3, 5, 6}}}}};
  for (int i = 0; i < cells; ++i)
    for (int j = 0; j < cells; ++j)
      for (int k = 0; k < cells; ++k)
        for (const Corners& corners : divisions[static_cast<std::size_t>((i + j + k) % 2)]) {
          Corners n;
          std::transform(corners.begin(), corners.end(), n.begin(), [&](int c) {
            return ((i + c % 2) * nodes + j + c / 2 % 2) * nodes + k + c / 4;
          });
          body->appendTetra(n[0], n[1], n[2], n[3]);
          for (std::size_t a = 0; a < 4; ++a)
            for (std::size_t b = a + 1; b < 4; ++b) body->appendLink(n[a], n[b], nullptr, true);
        }
  btSoftBodyHelpers::generateBoundaryFaces(body.get());
  body->setTotalMass(btScalar(mass));
  body->m_cfg.kDF = btScalar(0.5);
  body->m_cfg.kMT = btScalar(0.05);
  body->setPose(false, true);
  return body;
}

// Tetrahedra that are inside out.
int inverted_count(const btSoftBody& body) {
  int count = 0;
  for (int t = 0; t < body.m_tetras.size(); ++t) {
    const btSoftBody::Tetra& tetra = body.m_tetras[t];
    const btVector3& x = tetra.m_n[0]->m_x;
    const btScalar volume =
        (tetra.m_n[1]->m_x - x).dot((tetra.m_n[2]->m_x - x).cross(tetra.m_n[3]->m_x - x));
    count += volume * tetra.m_rv < 0;
  }
  return count;
}

btVector3 center_of(const btSoftBody& body) {
  btVector3 sum(0, 0, 0);
  for (int i = 0; i < body.m_nodes.size(); ++i) sum += body.m_nodes[i].m_x;
  return sum / btScalar(body.m_nodes.size());
}

struct Cubes {
  ObstacleWorld w;

  explicit Cubes(const bullet::SolverOptions& options = {}) : w(World::rigid, 10, options) {
    w.add(std::make_unique<btBoxShape>(btVector3(10, 1, 10)), btVector3(0, -1, 0));
  }

  btSoftBody* add(std::unique_ptr<btSoftBody> made, double height, int iterations) {
    made->translate(btVector3(0, btScalar(height), 0));
    btSoftBody* const body = w.add(std::move(made), cube_margin);
    body->m_cfg.piterations = iterations;
    return body;
  }
};

}  // namespace

TEST_CASE("a cube of tetrahedra that falls flat does not turn inside out") {
  const double height = GENERATE(0.4, 1.2, 2.5);
  const int iterations = GENERATE(1, 4, 8);
  CAPTURE(height, iterations);
  Cubes cubes;
  const btSoftBody& cube = *cubes.add(make_cube(cubes.w.info(), 3, 2), height, iterations);
  int most = 0;
  cubes.w.steps(180, 1.0 / 60, [&](int) { most = std::max(most, inverted_count(cube)); });
  CHECK(most <= 2);
  CHECK(inverted_count(cube) == 0);
  CHECK_THAT(static_cast<double>(center_of(cube).y()),
             Matchers::WithinAbs(side / 2 + cube_margin, 0.02));
  CHECK(speed(cube) < 0.1);
}

TEST_CASE("a cube of tetrahedra that falls on a corner loses at most that corner") {
  const double height = GENERATE(0.8, 1.2, 2.5);
  CAPTURE(height);
  Cubes cubes;
  std::unique_ptr<btSoftBody> made = make_cube(cubes.w.info(), 3, 2);
  made->rotate(btQuaternion(btScalar(0.3), btScalar(0.4), btScalar(-0.5)));
  const btSoftBody& cube = *cubes.add(std::move(made), height, 8);
  cubes.w.steps(180, 1.0 / 60);
  CHECK(inverted_count(cube) <= 2);
  CHECK(strain(cube) < 1.1);
}

TEST_CASE("a stack of cubes of tetrahedra stands") {
  constexpr int count = 4;
  Cubes cubes;
  std::vector<btSoftBody*> stack;
  for (int i = 0; i < count; ++i)
    stack.push_back(cubes.add(make_cube(cubes.w.info(), 2, 1), 0.23 + 0.44 * i, 8));
  cubes.w.steps(300, 1.0 / 60);
  for (int i = 0; i < count; ++i) {
    CAPTURE(i);
    const btVector3 center = center_of(*stack[static_cast<std::size_t>(i)]);
    CHECK_THAT(static_cast<double>(center.y()),
               Matchers::WithinAbs(0.22 + (side + 2 * cube_margin) * i, 0.06));
    CHECK(btVector3(center.x(), 0, center.z()).length() < btScalar(0.1));
    CHECK(inverted_count(*stack[static_cast<std::size_t>(i)]) == 0);
    CHECK(speed(*stack[static_cast<std::size_t>(i)]) < 0.2);
  }
}
