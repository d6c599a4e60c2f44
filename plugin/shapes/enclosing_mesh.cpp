#include "shapes/enclosing_mesh.h"

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConcaveShape.h>
#include <BulletCollision/CollisionShapes/btTriangleCallback.h>

#include "shapes/line_crossing.h"
#include "shapes/tessellation.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Faces through which the two halves of a line leave a mesh. Those through which they enter do not
// count: they may be walls of a room around the mesh.
struct Exits {
  int above = 0, below = 0;
};

class ExitCounter : public btTriangleCallback {
 public:
  // The line through `point` along an axis. `sign`: 1, or -1 for a mirrored mesh.
  ExitCounter(const btVector3& point, int axis, int sign, Exits& exits)
      : axis_(axis), sign_(sign), point_(turned(point)), exits_(exits) {}

  void processTriangle(btVector3* corners, int, int) override {
    const LineCrossing crossing =
        line_crossing(point_, turned(corners[0]), turned(corners[1]), turned(corners[2]));
    const bool is_above = crossing.z > point_[2];
    const int sign = is_above ? sign_ * crossing.sign : -sign_ * crossing.sign;
    if (sign > 0) (is_above ? exits_.above : exits_.below) += sign;
  }

 private:
  // With the axis as z.
  Vector3d turned(const btVector3& x) const {
    return {static_cast<double>(x[(axis_ + 1) % 3]), static_cast<double>(x[(axis_ + 2) % 3]),
            static_cast<double>(x[axis_])};
  }

  int axis_, sign_;
  Vector3d point_;
  Exits& exits_;
};

void count_exits(const btCollisionShape& shape, const btVector3& point, Exits& exits) {
  if (shape.isCompound()) {
    const auto& compound = static_cast<const btCompoundShape&>(shape);
    for (int i = 0; i < compound.getNumChildShapes(); ++i)
      count_exits(*compound.getChildShape(i), compound.getChildTransform(i).invXform(point), exits);
    return;
  }
  const int type = shape.getShapeType();
  if (!shape.isConcave() || type == STATIC_PLANE_PROXYTYPE || type == TERRAIN_SHAPE_PROXYTYPE ||
      !has_triangles(shape))
    return;
  btVector3 lower, upper;
  shape.getAabb(btTransform::getIdentity(), lower, upper);
  for (int k = 0; k < 3; ++k)
    if (!(lower[k] <= point[k] && point[k] <= upper[k])) return;
  // Along the shortest side the line meets the fewest triangles.
  const int axis = (upper - lower).minAxis();
  btVector3 first = point, last = point;
  first[axis] = lower[axis];
  last[axis] = upper[axis];
  ExitCounter counter(point, axis, is_mirrored(shape) ? -1 : 1, exits);
  static_cast<const btConcaveShape&>(shape).processAllTriangles(&counter, first, last);
}

}  // namespace

bool may_be_inside_mesh(const btCollisionShape& shape, const btVector3& point) {
  Exits exits;
  count_exits(shape, point, exits);
  return exits.above > 0 && exits.below > 0;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
