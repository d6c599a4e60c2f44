// Groups of bodies that are moved apart: what happens in one does not affect the others.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <cmath>

#include "plugin/support/obstacle_worlds.h"
#include "scenes/meshes/shapes.h"
#include "support/catch.h"
#include "util/matrix.h"

using namespace lazyccd;
using namespace lazyccd::test;
using lazyccd::bullet::Vector3d;
using scenes::vector;
using scenes::World;

namespace {

// Number of edges of `a` that pass through faces of `b`.
int intersections(const btSoftBody& a, const btSoftBody& b) {
  const auto read = [](const btSoftBody::Node* node) {
    return Vector3d(static_cast<double>(node->m_x.x()), static_cast<double>(node->m_x.y()),
                    static_cast<double>(node->m_x.z()));
  };
  int count = 0;
  for (int i = 0; i < a.m_links.size(); ++i) {
    if (a.m_links[i].m_bbending) continue;
    const Vector3d p = read(a.m_links[i].m_n[0]), q = read(a.m_links[i].m_n[1]);
    for (int f = 0; f < b.m_faces.size(); ++f) {
      const Vector3d x = read(b.m_faces[f].m_n[0]), y = read(b.m_faces[f].m_n[1]),
                     z = read(b.m_faces[f].m_n[2]);
      const auto volume = [](const Vector3d& u, const Vector3d& v, const Vector3d& w) {
        return u.dot(v.cross(w));
      };
      const bool crosses_plane = volume(x - p, y - p, z - p) * volume(x - q, y - q, z - q) < 0;
      const double xy = volume(q - p, x - p, y - p), yz = volume(q - p, y - p, z - p),
                   zx = volume(q - p, z - p, x - p);
      count += crosses_plane && ((xy > 0) == (yz > 0)) && ((yz > 0) == (zx > 0));
    }
  }
  return count;
}

struct Pair {
  btSoftBody *a, *b;
  int intersections() const { return ::intersections(*a, *b) + ::intersections(*b, *a); }
};

std::unique_ptr<btSoftBody> make_sheet(ObstacleWorld& w, int nodes, const btVector3& corner,
                                       const btVector3& u, const btVector3& v) {
  return scenes::make_cloth(w.info(), nodes, nodes, 1, [&](double s, double t) {
    return corner + static_cast<btScalar>(s) * u + static_cast<btScalar>(t) * v;
  });
}

// Two sheets that cross each other and come apart. `lift`: of the second one.
Pair add_crossed(ObstacleWorld& w, double lift = 0) {
  btSoftBody* a = w.add(make_sheet(w, 9, vector(-0.5, 0, -0.5), vector(1, 0, 0), vector(0, 0, 1)));
  btSoftBody* b = w.add(make_sheet(w, 9, vector(-0.4, lift - 0.15, -0.41), vector(0.83, 0, 0.01),
                                   vector(-0.01, 0.4, 0.83)));
  return {a, b};
}

// A sheet that hangs from pinned nodes through a pinned sheet, 50 m away. It stays there.
Pair add_stuck(ObstacleWorld& w) {
  btSoftBody* a = w.add(make_sheet(w, 9, vector(49.5, 0, -0.5), vector(1, 0, 0), vector(0, 0, 1)));
  for (int i = 0; i < a->m_nodes.size(); ++i) a->setMass(i, 0);
  btSoftBody* b =
      w.add(make_sheet(w, 7, vector(49.8, 0.01, 0.03), vector(0.4, 0, 0), vector(0, -0.61, 0)));
  for (int i = 0; i < b->m_nodes.size(); ++i)
    if (b->m_nodes[i].m_x.y() > 0) b->setMass(i, 0);
  return {a, b};
}

std::vector<btVector3> positions(const btSoftBody& body) {
  std::vector<btVector3> x;
  for (int i = 0; i < body.m_nodes.size(); ++i) x.push_back(body.m_nodes[i].m_x);
  return x;
}

btScalar largest_difference(const std::vector<btVector3>& a, const std::vector<btVector3>& b) {
  btScalar largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = btMax(largest, a[i].distance(b[i]));
  return largest;
}

}  // namespace

TEST_CASE("bodies come apart whatever is stuck elsewhere") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  const Pair crossed = add_crossed(w), stuck = add_stuck(w);
  REQUIRE(crossed.intersections() > 0);
  REQUIRE(stuck.intersections() > 0);
  w.steps(150, 1.0 / 60);
  CHECK(crossed.intersections() == 0);
  CHECK(stuck.intersections() > 0);
}

TEST_CASE("an impact is absorbed whatever is moved apart elsewhere") {
  ObstacleWorld w(World::rigid, 0), twin(World::rigid, 0);
  const auto add_ball = [](ObstacleWorld& world) {
    world.add(std::make_unique<btBoxShape>(vector(1, 0.5, 1)), vector(20, -0.5, 0));
    std::unique_ptr<btSoftBody> ball(btSoftBodyHelpers::CreateEllipsoid(
        world.info(), vector(20, 0.4, 0), vector(0.3, 0.3, 0.3), 100));
    ball->setTotalMass(1);
    btSoftBody* added = world.add(std::move(ball));
    added->m_cfg.piterations = 1;
    added->setVelocity(vector(0, -3, 0));
    return added;
  };
  const btSoftBody *ball = add_ball(w), *ball_of_twin = add_ball(twin);
  const Pair crossed = add_crossed(w);
  add_crossed(twin, 1);
  w.steps(15, 1.0 / 60);
  twin.steps(15, 1.0 / 60);
  REQUIRE(crossed.intersections() > 0);
  CHECK(largest_difference(positions(*ball), positions(*ball_of_twin)) < btScalar(1e-6));
}
