// Shapes without triangles of their own, and triangles without area.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btUniformScalingShape.h>

#include <initializer_list>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

TEST_CASE("a scaled polyhedron collides at its own corners") {
  const World world = GENERATE(World::rigid, World::deformable);
  // A needle so thin that sampling directions does not find all its corners.
  const btScalar corners[4][3] = {{0, btScalar(0.5), 0},
                                  {btScalar(0.02), 0, 0},
                                  {btScalar(-0.02), 0, btScalar(0.001)},
                                  {0, 0, btScalar(-0.001)}};
  btConvexHullShape needle;
  for (const auto& x : corners) needle.addPoint(btVector3(x[0], x[1], x[2]));
  needle.setMargin(btScalar(0.01));
  ObstacleWorld w(world, 0);
  w.add(std::make_unique<btUniformScalingShape>(&needle, btScalar(2)), btVector3(0, 0, 0));
  btSoftBody* sheet = w.add_sheet(2, 0.5, 1.2, 2);
  w.steps(60);
  REQUIRE(w.total().contacts_vf > 0);
  // The tip is at a height of 1 m, below the midpoint of two triangles. The margins add up to 3 cm.
  btScalar lowest = 10;
  for (int i = 0; i < 4; ++i) lowest = btMin(lowest, sheet->m_nodes[i].m_x.y());
  const btVector3 middle = (sheet->m_nodes[1].m_x + sheet->m_nodes[2].m_x) / 2;
  CHECK(static_cast<double>(btMax(lowest, middle.y())) > 1);
}

TEST_CASE("a mesh of degenerate triangles does not make a step fall back to Bullet") {
  const World world = GENERATE(World::rigid, World::deformable);
  ObstacleWorld w(world, 0);
  btTriangleMesh lines;
  lines.addTriangle(btVector3(-1, 0, 0), btVector3(1, 0, 0), btVector3(1, 0, 0));
  w.add(std::make_unique<btBvhTriangleMeshShape>(&lines, true), btVector3(0, 0, 0));
  w.add_sheet(4, 1, 0.05, 1);
  w.steps(10);
  CHECK(w.total().fallback_steps == 0);
}

TEST_CASE("convex shapes without thickness do not make a step fall back to Bullet") {
  const auto hull_of = [](std::initializer_list<btVector3> points) {
    auto hull = std::make_unique<btConvexHullShape>();
    for (const btVector3& point : points) hull->addPoint(point);
    return hull;
  };
  const btVector3 corners[4] = {{-2, 0, -2}, {2, 0, -2}, {2, 0, 2}, {-2, 0, 2}};
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  shapes.push_back(std::make_unique<btBoxShape>(btVector3(2, 0, 2)));
  shapes.push_back(std::make_unique<btCylinderShape>(btVector3(2, 0, 2)));
  shapes.push_back(hull_of({corners[0], corners[1], corners[2], corners[3]}));
  shapes.push_back(hull_of({corners[0], corners[1], corners[2], corners[2]}));
  for (std::unique_ptr<btCollisionShape>& shape : shapes) {
    const std::string name = shape->getName();
    CAPTURE(name);
    ObstacleWorld w(World::rigid, 10);
    w.add(std::move(shape), btVector3(0, 0, 0));
    btSoftBody* sheet = w.add_sheet(4, 1, 0.3, 1);
    sheet->translate(btVector3(btScalar(0.5), 0, btScalar(-0.5)));
    w.steps(60);
    CHECK(w.total().fallback_steps == 0);
    CHECK(static_cast<double>(sheet->m_nodes[0].m_x.y()) > 0);
  }
}

TEST_CASE("triangles of a mesh with a corner that is not finite are left out") {
  ObstacleWorld w(World::rigid, 10);
  btTriangleMesh mesh;
  mesh.addTriangle(btVector3(-4, 0, -4), btVector3(-4, 0, 8), btVector3(8, 0, -4));
  mesh.addTriangle(btVector3(-4, 0, 8), btVector3(8, 0, 8), btVector3(8, 0, -4));
  w.add(std::make_unique<btBvhTriangleMeshShape>(&mesh, true), btVector3(0, 0, 0));
  unsigned char* vertices;
  unsigned char* indices;
  int vertex_count, stride, index_stride, face_count;
  PHY_ScalarType type, index_type;
  mesh.getLockedVertexIndexBase(&vertices, vertex_count, type, stride, &indices, index_stride,
                                face_count, index_type);
  reinterpret_cast<btScalar*>(vertices + 4 * stride)[1] =
      std::numeric_limits<btScalar>::quiet_NaN();
  mesh.unLockVertexBase(0);
  btSoftBody* sheet = w.add_sheet(4, 1, 0.3, 1);
  w.steps(60);
  CHECK(w.total().fallback_steps == 0);
  CHECK(static_cast<double>(sheet->m_nodes[0].m_x.y()) > 0);
}

TEST_CASE("bodies without contact response are not counted as initial intersections") {
  const World world = GENERATE(World::rigid, World::deformable);
  ObstacleWorld w(world, 0);
  const auto sheet = [&](double tilt) {
    btSoftBody* body = w.add_sheet(4, 1, 0, 0);
    body->rotate(btQuaternion(btVector3(1, 0, 0), static_cast<btScalar>(tilt)));
    return body;
  };
  sheet(0);
  btSoftBody* ghost = sheet(1);
  ghost->setCollisionFlags(ghost->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  w.steps(1);
  CHECK(w.total().initial_intersections == 0);
  ghost->setCollisionFlags(ghost->getCollisionFlags() & ~btCollisionObject::CF_NO_CONTACT_RESPONSE);
  w.steps(1);
  CHECK(w.total().initial_intersections > 0);
}

TEST_CASE("a body of several components has a face tree if Bullet reads one") {
  // Two triangles that share a corner, two that share a side but have no link, and a rope in two
  // parts. Bullet's own face tree would never terminate for them.
  const World world = GENERATE(World::rigid, World::deformable);
  // With this option Bullet reads face trees in the deformable world.
  bullet::SolverOptions options;
  options.replace_rigid_contacts = false;
  ObstacleWorld w(world, 0, options);
  w.add(std::make_unique<btBoxShape>(btVector3(5, 5, 5)), btVector3(0, btScalar(-5.02), 0));
  const auto add = [&](const std::vector<std::array<int, 3>>& faces) {
    const btVector3 corners[] = {btVector3(0, 0, 0), btVector3(1, 0, 0), btVector3(0, 0, 1),
                                 btVector3(-1, 0, 0), btVector3(0, 0, -1)};
    auto body = std::make_unique<btSoftBody>(&w.info(), 5, corners, nullptr);
    for (const std::array<int, 3>& face : faces) body->appendFace(face[0], face[1], face[2]);
    btSoftBody* added = w.add(std::move(body));
    added->m_cfg.collisions |= btSoftBody::fCollision::SDF_RDF;
    return added;
  };
  btSoftBody* by_a_corner = add({{0, 1, 2}, {0, 3, 4}});
  for (const auto& side : {std::array<int, 2>{0, 1}, {1, 2}, {2, 0}, {0, 3}, {3, 4}, {4, 0}})
    by_a_corner->appendLink(side[0], side[1]);
  add({{0, 1, 2}, {0, 2, 3}})->translate(btVector3(0, 1, 0));
  btSoftBody* rope = add({});
  rope->appendLink(1, 2);
  rope->appendLink(3, 4);
  rope->translate(btVector3(0, 2, 0));
  w.steps(3);
  CHECK(w.total().fallback_steps == 0);
  // The tree is built only if Bullet reads it.
  if (world == World::deformable) CHECK(by_a_corner->m_fdbvt.m_leaves == 2);
}
