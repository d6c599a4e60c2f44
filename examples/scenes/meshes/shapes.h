// Collision shapes of rigid bodies.
#pragma once

#include <BulletCollision/CollisionShapes/btCollisionShape.h>

#include <functional>
#include <memory>

namespace lazyccd::scenes {

btVector3 vector(double x, double y, double z);
/// Returns a pose at this position, without rotation.
btTransform at(double x, double y, double z);

/// Lengths of the whole sides, metres.
std::unique_ptr<btCollisionShape> make_box(double x, double y, double z);
std::unique_ptr<btCollisionShape> make_sphere(double radius);

/// Makes a triangle mesh of columns x rows quads. point(u, v): the position for u, v in [0, 1].
std::unique_ptr<btCollisionShape> make_mesh(
    int columns, int rows, const std::function<btVector3(double u, double v)>& point);

}  // namespace lazyccd::scenes
