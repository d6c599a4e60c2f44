// Tells cheaply whether a point may be inside of a mesh.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// False if no mesh of the shape that is closed, and whose faces point outwards, can contain the
/// point. Asks the shape's own hierarchy for the triangles on one line, and looks at them alone.
/// Terrains and planes are no meshes here. `point` is in the frame of the shape.
bool may_be_inside_mesh(const btCollisionShape& shape, const btVector3& point);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
