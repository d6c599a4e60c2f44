#include "touching/oriented_surface.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "motion/rotation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

Vector3d normalized(const Vector3d& x) {
  const double length = x.norm();
  return length > 0 ? x / length : Vector3d::Zero();
}

double angle_between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// A side of a face: its vertices in ascending order, and whether the face runs along it that way.
struct FaceSide {
  std::int32_t first, last, face;
  bool is_ascending;
};

std::vector<FaceSide> sorted_sides(const Span<const Face>& faces) {
  std::vector<FaceSide> sides;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t a = faces[f][k], b = faces[f][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<std::int32_t>(f), a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const FaceSide& a, const FaceSide& b) {
    return std::tie(a.first, a.last, a.face) < std::tie(b.first, b.last, b.face);
  });
  return sides;
}

// The parts of a surface that sides of two faces connect, and how their faces are turned.
class Parts {
 public:
  explicit Parts(const Span<const Face>& faces)
      : neighbours_(faces.size()), is_turned_(faces.size(), 0), part_of_(faces.size(), -1) {
    const std::vector<FaceSide> sides = sorted_sides(faces);
    std::vector<char> is_open(faces.size(), 0);
    for (std::size_t i = 0; i < sides.size();) {
      std::size_t end = i + 1;
      while (end < sides.size() && sides[end].first == sides[i].first &&
             sides[end].last == sides[i].last)
        ++end;
      if (end == i + 2) {
        const bool is_alike = sides[i].is_ascending != sides[i + 1].is_ascending;
        neighbours_[sides[i].face].push_back({sides[i + 1].face, is_alike});
        neighbours_[sides[i + 1].face].push_back({sides[i].face, is_alike});
      } else {
        for (std::size_t k = i; k < end; ++k) is_open[sides[k].face] = 1;
      }
      i = end;
    }
    for (std::size_t f = 0; f < faces.size(); ++f)
      if (part_of_[f] < 0) add_part(static_cast<std::int32_t>(f), is_open);
  }

  std::size_t count() const { return is_closed_.size(); }
  std::int32_t part_of(std::size_t face) const { return part_of_[face]; }
  // Whether the face is turned against the first face of its part.
  bool is_turned(std::size_t face) const { return is_turned_[face] != 0; }
  bool is_closed(std::size_t part) const { return is_closed_[part] != 0; }
  // Whether some face of the part is turned.
  bool any_turned(std::size_t part) const { return any_turned_[part] != 0; }

 private:
  struct Neighbour {
    std::int32_t face;
    bool is_alike;  // both run along their common side in opposite directions
  };

  void add_part(std::int32_t first, const std::vector<char>& is_open) {
    const auto part = static_cast<std::int32_t>(count());
    bool is_closed = true, any_turned = false;
    std::vector<std::int32_t> waiting = {first};
    part_of_[first] = part;
    while (!waiting.empty()) {
      const std::int32_t face = waiting.back();
      waiting.pop_back();
      is_closed = is_closed && !is_open[face];
      any_turned = any_turned || is_turned_[face];
      for (const Neighbour& next : neighbours_[face]) {
        if (part_of_[next.face] >= 0) continue;
        part_of_[next.face] = part;
        is_turned_[next.face] = static_cast<char>(is_turned_[face] == (next.is_alike ? 1 : 0));
        waiting.push_back(next.face);
      }
    }
    is_closed_.push_back(is_closed);
    any_turned_.push_back(any_turned);
  }

  std::vector<std::vector<Neighbour>> neighbours_;  // by face
  std::vector<char> is_turned_;                     // by face
  std::vector<std::int32_t> part_of_;               // by face
  std::vector<char> is_closed_, any_turned_;        // by part
};

}  // namespace

Vector3d up_of(const StepTopology& topology, const Motion& motion, std::int32_t obstacle) {
  const btCollisionShape& shape = *topology.bodies()[obstacle].object->getCollisionShape();
  const Matrix3d basis = to_double(motion.rigid_of(obstacle).start.getBasis());
  if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE)
    return basis * to_double(static_cast<const btStaticPlaneShape&>(shape).getPlaneNormal());
  if (shape.getShapeType() == TERRAIN_SHAPE_PROXYTYPE)
    return basis.col(static_cast<const btHeightfieldTerrainShape&>(shape).getUpAxis());
  return Vector3d::Zero();
}

OrientedSurface::OrientedSurface(const StepTopology& topology, const Motion& motion,
                                 std::int32_t body) {
  const StepTopology::BodyRecord& record = topology.bodies()[body];
  const Topology view = topology.topology();
  first_face_ = record.faces.first;
  first_vertex_ = record.first_vertex;
  first_around_.assign(static_cast<std::size_t>(record.vertex_count) + 1, 0);
  for (std::int32_t f = record.faces.first; f < record.faces.last; ++f) {
    const Face& face = view.faces[f];
    const std::array<Vector3d, 3> x = {motion.start_of(face[0]), motion.start_of(face[1]),
                                       motion.start_of(face[2])};
    faces_.push_back({face, normalized((x[1] - x[0]).cross(x[2] - x[0])), false});
    for (std::size_t k = 0; k < 3; ++k) {
      angles_.push_back(angle_between(x[(k + 1) % 3] - x[k], x[(k + 2) % 3] - x[k]));
      ++first_around_[static_cast<std::size_t>(face[k] - first_vertex_) + 1];
    }
  }
  for (std::size_t v = 1; v < first_around_.size(); ++v) first_around_[v] += first_around_[v - 1];
  around_.resize(3 * faces_.size());
  std::vector<std::int32_t> next = first_around_;
  for (std::size_t f = 0; f < faces_.size(); ++f)
    for (const std::int32_t v : faces_[f].vertices)
      around_[next[v - first_vertex_]++] = first_face_ + static_cast<std::int32_t>(f);
  orient(topology, motion, body);
}

void OrientedSurface::orient(const StepTopology& topology, const Motion& motion,
                             std::int32_t body) {
  const StepTopology::BodyRecord& record = topology.bodies()[body];
  const Vector3d up = record.soft ? Vector3d::Zero() : up_of(topology, motion, body);
  if (!up.isZero()) {
    for (OrientedFace& face : faces_) {
      face.is_of_solid = true;
      if (face.normal.dot(up) < 0) face.normal = -face.normal;
    }
    return;
  }
  if (faces_.empty()) return;
  const Parts parts({&topology.topology().faces[first_face_], faces_.size()});
  // Six times the volumes, m^3, relative to some point near the body.
  std::vector<double> volumes(parts.count(), 0);
  const Vector3d origin = motion.start_of(faces_[0].vertices[0]);
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const Face& face = faces_[f].vertices;
    const Vector3d a = motion.start_of(face[0]) - origin, b = motion.start_of(face[1]) - origin,
                   c = motion.start_of(face[2]) - origin;
    volumes[parts.part_of(f)] += (parts.is_turned(f) ? -1 : 1) * a.dot(b.cross(c));
  }
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    const auto part = static_cast<std::size_t>(parts.part_of(f));
    // The faces of a rigid body that all point inwards are those of a room.
    const bool may_be_room = !record.soft && !parts.any_turned(part);
    const bool points_inwards = parts.is_closed(part) && volumes[part] < 0 && !may_be_room;
    faces_[f].is_of_solid = parts.is_closed(part);
    if (parts.is_turned(f) != points_inwards) faces_[f].normal = -faces_[f].normal;
  }
}

OrientedSurface::Normal OrientedSurface::of_face(std::int32_t face) const {
  return {face_of(face).normal, face_of(face).is_of_solid};
}

OrientedSurface::Normal OrientedSurface::of_edge(std::int32_t a, std::int32_t b) const {
  Normal normal;
  for (const std::int32_t f : faces_around(a)) {
    const OrientedFace& face = face_of(f);
    if (std::find(face.vertices.begin(), face.vertices.end(), b) == face.vertices.end()) continue;
    normal.direction += face.normal;
    normal.is_of_solid = face.is_of_solid;
  }
  normal.direction = normalized(normal.direction);
  return normal;
}

OrientedSurface::Normal OrientedSurface::of_vertex(std::int32_t vertex) const {
  Normal normal;
  for (const std::int32_t f : faces_around(vertex)) {
    const OrientedFace& face = face_of(f);
    const auto k =
        std::find(face.vertices.begin(), face.vertices.end(), vertex) - face.vertices.begin();
    normal.direction +=
        angles_[3 * static_cast<std::size_t>(f - first_face_) + static_cast<std::size_t>(k)] *
        face.normal;
    normal.is_of_solid = face.is_of_solid;
  }
  normal.direction = normalized(normal.direction);
  return normal;
}

Span<const std::int32_t> OrientedSurface::faces_around(std::int32_t vertex) const {
  const auto v = static_cast<std::size_t>(vertex - first_vertex_);
  return {around_.data() + first_around_[v],
          static_cast<std::size_t>(first_around_[v + 1] - first_around_[v])};
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
