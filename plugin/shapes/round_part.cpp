#include "shapes/round_part.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

constexpr btScalar tolerance = btScalar(settings::shapes::exit_tolerance);

}  // namespace

btScalar closest_on_segment(const btVector3& x, const btVector3& a, const btVector3& b) {
  const btVector3 along = b - a;
  const btScalar length2 = along.length2();
  return length2 > 0 ? std::clamp((x - a).dot(along) / length2, btScalar(0), btScalar(1)) : 0;
}

bool find_core(const btConvexShape& shape, std::array<btVector3, 2>& core) {
  core = {btVector3(0, 0, 0), btVector3(0, 0, 0)};
  if (shape.getShapeType() == SPHERE_SHAPE_PROXYTYPE) return true;
  if (shape.getShapeType() != CAPSULE_SHAPE_PROXYTYPE) return false;
  const auto& capsule = static_cast<const btCapsuleShape&>(shape);
  core[0][capsule.getUpAxis()] = -capsule.getHalfHeight();
  core[1][capsule.getUpAxis()] = capsule.getHalfHeight();
  return true;
}

RoundPart make_round_part(const std::array<btVector3, 2>& core,
                          const std::vector<btVector3>& vertices, std::int32_t first_vertex,
                          const std::vector<Face>& faces, std::int32_t first_face) {
  RoundPart part;
  part.core = core;
  part.first_face = first_face;
  part.inner_radius = std::numeric_limits<double>::infinity();
  const btVector3 centre = (core[0] + core[1]) / 2;
  for (std::size_t i = static_cast<std::size_t>(first_face); i < faces.size(); ++i) {
    const btVector3 corners[] = {vertices[faces[i][0]], vertices[faces[i][1]],
                                 vertices[faces[i][2]]};
    for (const btVector3& x : corners) {
      const btVector3 nearest = core[0].lerp(core[1], closest_on_segment(x, core[0], core[1]));
      part.outer_radius = std::max(part.outer_radius, static_cast<double>(x.distance(nearest)));
    }
    btVector3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    if (normal.dot(corners[0] - centre) < 0) normal = -normal;
    normal.safeNormalize();
    // The plane touches the part also if rounding turned the normal of a narrow face.
    btScalar offset = normal.dot(corners[0]);
    for (auto x = vertices.begin() + first_vertex; x != vertices.end(); ++x)
      offset = btMax(offset, normal.dot(*x));
    part.planes.push_back({normal, offset});
    part.corners.push_back({corners[0], corners[1], corners[2]});
    for (const btVector3& end : core)
      part.inner_radius =
          std::min(part.inner_radius, static_cast<double>(offset - normal.dot(end)));
  }
  // A ray from the core along d passes the plane of a face with normal n after at least
  // inner_radius / (n . d). So faces that it passes within outer_radius have at least this n . d:
  const double min_cosine =
      part.inner_radius / (part.outer_radius * (1 + static_cast<double>(tolerance)));
  std::vector<btVector3> normals;
  normals.reserve(part.planes.size());
  for (const RoundPart::Plane& plane : part.planes) normals.push_back(plane.normal);
  part.faces_by_normal = DirectionGrid(normals, min_cosine);
  return part;
}

FacePoint find_exit(const RoundPart& part, const btVector3& point, const btVector3& direction) {
  const auto distance_to = [&](const RoundPart::Plane& plane) {
    const btScalar rate = plane.normal.dot(direction);
    return rate > 0 ? (plane.offset - plane.normal.dot(point)) / rate
                    : std::numeric_limits<btScalar>::infinity();
  };
  Span<const std::int32_t> faces = part.faces_by_normal.near(direction);
  const auto first_distance = [&] {
    btScalar first = std::numeric_limits<btScalar>::infinity();
    for (const std::int32_t i : faces) first = btMin(first, distance_to(part.planes[i]));
    return first;
  };
  btScalar first = first_distance();
  if (!(static_cast<double>(first) <= part.outer_radius)) {
    faces = part.faces_by_normal.all();
    first = first_distance();
  }
  const btVector3 hit = point + first * direction;
  FacePoint exit;
  btScalar best = -std::numeric_limits<btScalar>::infinity();
  for (const std::int32_t i : faces) {
    if (!(distance_to(part.planes[i]) <= first + tolerance * btFabs(first))) continue;
    const auto& [a, b, c] = part.corners[i];
    const btVector3 ab = b - a, ac = c - a, across = ab.cross(ac);
    const btScalar area = across.length2();
    if (!(area > 0)) continue;
    const btScalar u = across.dot((hit - a).cross(ac)) / area,
                   v = across.dot(ab.cross(hit - a)) / area;
    const btScalar inside = btMin(btMin(u, v), 1 - u - v);
    if (inside <= best) continue;
    best = inside;
    exit.face = i;
    exit.u = std::clamp(u, btScalar(0), btScalar(1));
    exit.v = std::clamp(v, btScalar(0), 1 - exit.u);
  }
  return exit;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
