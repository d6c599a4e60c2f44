#include "scenes/meshes/shapes.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btTriangleMesh.h>

namespace lazyccd::scenes {
namespace {

// A triangle mesh shape that owns its triangles. They are in a base class, because they must exist
// before the shape is constructed.
struct OwnedMesh {
  std::unique_ptr<btTriangleMesh> mesh;
};
class OwningMeshShape : private OwnedMesh, public btBvhTriangleMeshShape {
 public:
  explicit OwningMeshShape(std::unique_ptr<btTriangleMesh> triangles)
      : OwnedMesh{std::move(triangles)}, btBvhTriangleMeshShape(mesh.get(), true) {}
};

}  // namespace

btVector3 vector(double x, double y, double z) {
  return btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z));
}

btTransform at(double x, double y, double z) {
  return btTransform(btQuaternion::getIdentity(), vector(x, y, z));
}

std::unique_ptr<btCollisionShape> make_box(double x, double y, double z) {
  return std::make_unique<btBoxShape>(vector(x / 2, y / 2, z / 2));
}

std::unique_ptr<btCollisionShape> make_sphere(double radius) {
  return std::make_unique<btSphereShape>(static_cast<btScalar>(radius));
}

std::unique_ptr<btCollisionShape> make_mesh(
    int columns, int rows, const std::function<btVector3(double u, double v)>& point) {
  auto mesh = std::make_unique<btTriangleMesh>();
  const auto corner = [&](int i, int j) { return point(i / double(columns), j / double(rows)); };
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      mesh->addTriangle(corner(i, j), corner(i, j + 1), corner(i + 1, j + 1));
      mesh->addTriangle(corner(i, j), corner(i + 1, j + 1), corner(i + 1, j));
    }
  }
  return std::make_unique<OwningMeshShape>(std::move(mesh));
}

}  // namespace lazyccd::scenes
