#include "untangling/closed_surfaces.h"

#include <algorithm>
#include <cmath>

#include "settings.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Half the solid angle that the triangle covers as seen from the origin, signed by its orientation.
// Van Oosterom and Strackee 1983, "The solid angle of a plane triangle".
double half_solid_angle(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return std::atan2(a.dot(b.cross(c)),
                    la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

}  // namespace

bool is_closed_mesh(const Topology& topology, const std::vector<std::int32_t>& faces) {
  std::vector<Edge> sides;
  for (const std::int32_t f : faces) {
    const Face& face = topology.faces[f];
    for (int k = 0; k < 3; ++k) {
      const std::int32_t a = face[k], b = face[(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b)});
    }
  }
  std::sort(sides.begin(), sides.end());
  for (std::size_t i = 0; i < sides.size(); i += 2) {
    const bool has_two_faces = i + 1 < sides.size() && sides[i] == sides[i + 1];
    if (!has_two_faces || (i + 2 < sides.size() && sides[i] == sides[i + 2])) return false;
  }
  return !sides.empty();
}

double volume_of(const Topology& topology, const Motion& motion,
                 const std::vector<std::int32_t>& faces) {
  const Vector3d origin = motion.start_of(topology.faces[faces.front()][0]);
  double volume = 0;
  for (const std::int32_t f : faces) {
    const Face& face = topology.faces[f];
    const Vector3d a = motion.start_of(face[0]) - origin, b = motion.start_of(face[1]) - origin,
                   c = motion.start_of(face[2]) - origin;
    volume += a.dot(b.cross(c)) / 6;
  }
  return volume;
}

double winding_number(const Topology& topology, const Motion& motion,
                      const std::vector<std::int32_t>& faces, const Vector3d& point) {
  constexpr double pi = 3.14159265358979;
  double sum = 0;
  for (const std::int32_t f : faces) {
    const Face& face = topology.faces[f];
    sum += half_solid_angle(motion.start_of(face[0]) - point, motion.start_of(face[1]) - point,
                            motion.start_of(face[2]) - point);
  }
  return sum / (2 * pi);
}

ClosedSurfaces::ClosedSurfaces(const Topology& topology, const Motion& motion)
    : topology_(topology), motion_(motion), faces_(topology.bodies.size()) {
  for (std::size_t f = 0; f < topology.faces.size(); ++f)
    faces_[topology.body_of_vertex[topology.faces[f][0]]].push_back(static_cast<std::int32_t>(f));
  for (const std::vector<std::int32_t>& faces : faces_)
    closed_.push_back(is_closed_mesh(topology, faces) &&
                      (is_soft(faces) || volume_of(topology, motion, faces) > 0));
}

bool ClosedSurfaces::is_soft(const std::vector<std::int32_t>& faces) const {
  return motion_.is_soft(topology_.faces[faces.front()][0]);
}

bool ClosedSurfaces::contains(std::int32_t body, const Vector3d& point) const {
  const double winding = winding_number(topology_, motion_, faces_[body], point);
  return (is_soft(faces_[body]) ? std::abs(winding) : winding) >
         settings::untangling::inside_winding;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
