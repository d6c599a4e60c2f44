// Penetrations: what starts inside of a rigid body comes out, if the body has an inside there.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <cmath>

#include "plugin/support/obstacle_worlds.h"
#include "scenes/meshes/shapes.h"
#include "scenes/scene.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::vector;
using scenes::World;

namespace {

// A square sheet in the plane y = height, with `nodes` x `nodes` nodes.
btSoftBody* add_sheet(ObstacleWorld& w, int nodes, double width, const btVector3& centre) {
  return w.add(scenes::make_cloth(w.info(), nodes, nodes, 1, [&](double u, double v) {
    return centre + vector(width * (u - 0.5), 0, width * (v - 0.5));
  }));
}

btSoftBody* add_ball(ObstacleWorld& w, const btVector3& centre, double radius) {
  std::unique_ptr<btSoftBody> ball(
      btSoftBodyHelpers::CreateEllipsoid(w.info(), centre, vector(radius, radius, radius), 80));
  ball->setTotalMass(1);
  return w.add(std::move(ball));
}

// Adds the triangles of a cube with half the side `half`.
void add_cube(btTriangleMesh& mesh, double half, bool inwards) {
  const auto corner = [&](int i) {
    return vector(i & 1 ? half : -half, i & 2 ? half : -half, i & 4 ? half : -half);
  };
  const int sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 4, 6, 2},
                           {1, 3, 7, 5}, {2, 6, 7, 3}, {0, 1, 5, 4}};
  for (const auto& side : sides) {
    for (const int first : {0, 2}) {
      const int a = side[first], b = side[first + 1], c = side[(first + 2) % 4];
      mesh.addTriangle(corner(a), corner(inwards ? c : b), corner(inwards ? b : c));
    }
  }
}

// Height at which the vertical line through a point meets the sheet.
btScalar height_below(const btSoftBody& sheet, const btVector3& point) {
  const auto area = [](const btVector3& u, const btVector3& v) {
    return u.z() * v.x() - u.x() * v.z();
  };
  for (int i = 0; i < sheet.m_faces.size(); ++i) {
    const btVector3 a = sheet.m_faces[i].m_n[0]->m_x - point,
                    b = sheet.m_faces[i].m_n[1]->m_x - point,
                    c = sheet.m_faces[i].m_n[2]->m_x - point;
    const btScalar u = area(b, c), v = area(c, a), w = area(a, b), sum = u + v + w;
    if (u / sum >= 0 && v / sum >= 0 && w / sum >= 0)
      return point.y() + (u * a.y() + v * b.y() + w * c.y()) / sum;
  }
  return BT_LARGE_FLOAT;
}

int nodes_inside(const btSoftBody& body, double half) {
  int count = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    const btVector3 x = body.m_nodes[i].m_x.absolute();
    count += static_cast<double>(x[x.maxAxis()]) < half;
  }
  return count;
}

}  // namespace

TEST_CASE("a rigid box that pierces a triangle away from its edges comes out") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  const btVector3 half = vector(0.1, 0.2, 0.1);
  const btRigidBody* box = w.add(std::make_unique<btBoxShape>(half), vector(0.3, 0.05, 0), 1);
  btSoftBody* cloth = add_sheet(w, 4, 3, vector(0, 0, 0));
  for (int i = 0; i < cloth->m_nodes.size(); ++i) {
    const bool is_inner = i / 4 % 3 != 0 && i % 4 % 3 != 0;
    if (!is_inner) cloth->setMass(i, 0);
  }
  bool any_on_face = false;
  w.steps(60, 1.0 / 60, [&](int) {
    for (const bullet::StepContact& contact : w.contacts()) {
      if (!contact.face) continue;
      any_on_face = true;
      for (std::size_t k = 0; k < 3; ++k) CHECK(contact.nodes[k + 1] == contact.face->m_n[k]);
    }
  });
  CHECK(any_on_face);
  REQUIRE(w.total().initial_intersections > 0);
  // The lower side of the box was 0.15 below the sheet.
  const btVector3 centre = box->getCenterOfMassPosition();
  CHECK(centre.y() - half.y() > height_below(*cloth, centre));
}

TEST_CASE("a triangle of zero area does not close the way out of a convex mesh") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool has_flat_triangle = GENERATE(false, true);
  CAPTURE(world == World::rigid, has_flat_triangle);
  ObstacleWorld w(world, 0);
  constexpr double half = 0.3;
  btTriangleMesh mesh;
  if (!has_flat_triangle) {
    add_cube(mesh, half, false);
  } else {
    // The edge between corners 0 and 1 is split on the lower side alone.
    btTriangleMesh cube;
    add_cube(cube, half, false);
    const btVector3 a = vector(-half, -half, -half), b = vector(half, -half, -half),
                    c = vector(half, -half, half), middle = vector(0, -half, -half);
    for (int i = 0; i < cube.getNumTriangles(); ++i) {
      const unsigned char *vertices, *indices;
      int count, stride, index_stride, faces;
      PHY_ScalarType type, index_type;
      cube.getLockedReadOnlyVertexIndexBase(&vertices, count, type, stride, &indices, index_stride,
                                            faces, index_type);
      const auto corner = [&](int k) {
        const int index = reinterpret_cast<const int*>(indices + i * index_stride)[k];
        return *reinterpret_cast<const btVector3*>(vertices + index * stride);
      };
      const bool is_split = corner(0) == a && corner(1) == b && corner(2) == c;
      if (!is_split) mesh.addTriangle(corner(0), corner(1), corner(2));
    }
    REQUIRE(mesh.getNumTriangles() == 11);
    mesh.addTriangle(a, middle, c);
    mesh.addTriangle(middle, b, c);
    mesh.addTriangle(b, middle, a);
  }
  w.add(std::make_unique<btBvhTriangleMeshShape>(&mesh, true), vector(0, 0, 0));
  const btSoftBody* ball = add_ball(w, vector(0.02, 0.06, 0.01), 0.2);
  w.steps(90, 1.0 / 60);
  CHECK(nodes_inside(*ball, half) == 0);
}

namespace {

btVector3 mean_position(const btSoftBody& body) {
  btVector3 sum(0, 0, 0);
  for (int i = 0; i < body.m_nodes.size(); ++i) sum += body.m_nodes[i].m_x;
  return sum / static_cast<btScalar>(body.m_nodes.size());
}

// Two sheets that cross each other, 50 m away.
void add_crossed_far_away(ObstacleWorld& w) {
  add_sheet(w, 9, 1, vector(50, 0, 0));
  w.add(scenes::make_cloth(w.info(), 9, 9, 1, [](double u, double v) {
    return vector(49.6 + 0.83 * u, -0.07 + 0.22 * v, -0.41 + 0.83 * v);
  }));
}

}  // namespace

TEST_CASE("a soft body in a room stays there") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool has_outer_walls = GENERATE(false, true);
  const double half = GENERATE(0.5, 2.0);
  CAPTURE(world == World::rigid, has_outer_walls, half);
  ObstacleWorld w(world, 0);
  btTriangleMesh room;
  add_cube(room, half, true);
  if (has_outer_walls) add_cube(room, 1.1 * half, false);
  w.add(std::make_unique<btBvhTriangleMeshShape>(&room, true), vector(0, 0, 0));
  const btSoftBody* ball = add_ball(w, vector(0, 0.1, 0), 0.2);
  const btVector3 start = mean_position(*ball);
  w.steps(60, 1.0 / 60);
  CHECK(mean_position(*ball).distance(start) < btScalar(0.01));
  add_crossed_far_away(w);
  w.steps(60, 1.0 / 60);
  CHECK(w.total().initial_intersections > 0);
  CHECK(mean_position(*ball).distance(start) < btScalar(0.01));
}

TEST_CASE("a soft body wholly inside of a closed mesh comes out, alone and beside others") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool is_alone = GENERATE(true, false);
  const double half = GENERATE(0.3, 1.0);
  const bool is_mesh_placed = GENERATE(false, true);
  CAPTURE(world == World::rigid, is_alone, half, is_mesh_placed);
  ObstacleWorld w(world, 0);
  btTriangleMesh mesh;
  add_cube(mesh, half, false);
  const auto add_mesh = [&] {
    w.add(std::make_unique<btBvhTriangleMeshShape>(&mesh, true), vector(0, 0, 0));
  };
  if (!is_mesh_placed) add_mesh();
  const btSoftBody* sheet = add_sheet(w, 6, 0.4, vector(0, 0.2, 0));
  if (!is_alone) add_crossed_far_away(w);
  if (is_mesh_placed) {
    w.steps(5, 1.0 / 60);
    add_mesh();
  }
  w.steps(180, 1.0 / 60);
  CHECK(nodes_inside(*sheet, half) == 0);
}

TEST_CASE("what is inside of the wall of a hollow mesh comes out") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btTriangleMesh shell;
  add_cube(shell, 1, false);
  add_cube(shell, 0.5, true);
  w.add(std::make_unique<btBvhTriangleMeshShape>(&shell, true), vector(0, 0, 0));
  const btSoftBody* near_cavity = add_sheet(w, 5, 0.2, vector(0.1, 0.6, 0));
  const btSoftBody* near_outside = add_sheet(w, 5, 0.2, vector(0.1, -0.9, 0));
  w.steps(120, 1.0 / 60);
  CHECK(nodes_inside(*near_cavity, 0.5) == 25);
  CHECK(nodes_inside(*near_outside, 1) == 0);
}
