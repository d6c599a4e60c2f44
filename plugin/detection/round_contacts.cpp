#include "detection/round_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// Of the thickness: what the response may leave of it at rest.
constexpr double kept_thickness = 0.9;
// With more pairs of a vertex and a ball or capsule, the detector's hierarchy is faster.
constexpr std::int64_t max_pairs = 1 << 15;

// Distance between the segments a + s u and b + t v with s, t in [0, 1]. Ericson 2005, "Real-Time
// Collision Detection", section 5.1.9.
double segment_distance(const Vector3d& a, const Vector3d& u, const Vector3d& b,
                        const Vector3d& v) {
  const Vector3d w = a - b;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), vw = v.dot(w);
  double s = 0, t = 0;
  if (!(vv > 0)) {
    s = uu > 0 ? std::clamp(-u.dot(w) / uu, 0.0, 1.0) : 0;
  } else {
    const double uv = u.dot(v), uw = u.dot(w), area = uu * vv - uv * uv;
    if (area > 0) s = std::clamp((uv * vw - uw * vv) / area, 0.0, 1.0);
    t = (uv * s + vw) / vv;
    if (t < 0 || t > 1) {
      t = std::clamp(t, 0.0, 1.0);
      s = uu > 0 ? std::clamp((uv * t - uw) / uu, 0.0, 1.0) : 0;
    }
  }
  return (w + s * u - t * v).norm();
}

Vector3d transformed(const btTransform& pose, const btVector3& x) {
  const btMatrix3x3& basis = pose.getBasis();
  const Vector3d local = to_eigen(x);
  Vector3d world = to_eigen(pose.getOrigin());
  for (int k = 0; k < 3; ++k) world[k] += to_eigen(basis[k]).dot(local);
  return world;
}

}  // namespace

struct RoundContacts::MovingCore {
  Vector3d start[2], end[2];

  MovingCore(const RoundPart& part, const RigidMotion& rigid, bool at_start) {
    for (int k = 0; k < 2; ++k) {
      start[k] = transformed(rigid.start, part.core[k]);
      end[k] = at_start ? start[k] : transformed(rigid.end, part.core[k]);
    }
  }

  // Parameter of the point of the core that is closest to x at time t.
  double closest(const Vector3d& x, double t, Vector3d& point) const {
    const Vector3d a = (1 - t) * start[0] + t * end[0], b = (1 - t) * start[1] + t * end[1];
    const Vector3d along = b - a;
    const double length2 = along.squaredNorm();
    const double s = length2 > 0 ? std::clamp((x - a).dot(along) / length2, 0.0, 1.0) : 0;
    point = a + s * along;
    return s;
  }
  double distance(const Vector3d& x, double t) const {
    Vector3d point;
    closest(x, t, point);
    return (x - point).norm();
  }
  // Upper bound of how far a vertex moves relative to any point of the core.
  double relative_move(const Vector3d& x0, const Vector3d& x1) const {
    const Vector3d move = x1 - x0;
    return std::max((move - (end[0] - start[0])).norm(), (move - (end[1] - start[1])).norm());
  }
  // Lower bound of the distance of a vertex over the whole motion. Exact if the core does not turn.
  double smallest_distance(const Vector3d& x0, const Vector3d& x1) const {
    const Vector3d turn = 0.5 * ((end[1] - start[1]) - (end[0] - start[0]));
    const Vector3d shift = 0.5 * ((end[0] - start[0]) + (end[1] - start[1]));
    return segment_distance(x0, x1 - shift - x0, start[0], start[1] - start[0]) - turn.norm();
  }
  // Upper bound of the rounding of Bullet's positions of the part's vertices, metres.
  double rounding(double radius) const {
    constexpr double count = 64;
    double largest = radius;
    for (int k = 0; k < 2; ++k)
      largest = std::max({largest, start[k].lpNorm<Eigen::Infinity>() + radius,
                          end[k].lpNorm<Eigen::Infinity>() + radius});
    return count * static_cast<double>(std::numeric_limits<btScalar>::epsilon()) * largest;
  }
};

void RoundContacts::set_topology() {
  obstacles_.clear();
  measure_edges_squared(topology_, motion_, true, edges_squared_);
  std::int64_t pairs = 0;
  for (ObstaclePairs& obstacle : find_obstacle_pairs(topology_)) {
    const Triangles& triangles = *topology_.bodies()[obstacle.body].triangles;
    if (!triangles.is_round() || !suits(obstacle)) continue;
    const auto parts = static_cast<std::int64_t>(triangles.round_parts.size());
    for (const std::int32_t s : obstacle.soft_bodies)
      pairs += parts * topology_.bodies()[s].vertex_count;
    obstacles_.push_back(std::move(obstacle));
  }
  if (pairs > max_pairs) clear();
}

// True if the bound holds where faces of mean size rest on the obstacle.
bool RoundContacts::suits(const ObstaclePairs& obstacle) const {
  const Triangles& triangles = *topology_.bodies()[obstacle.body].triangles;
  for (const std::int32_t s : obstacle.soft_bodies) {
    if (!topology_.bodies()[s].responds) return false;
    const double gap = kept_thickness * surfaces_.of(s, obstacle.body).thickness;
    for (const RoundPart& part : triangles.round_parts) {
      const double at_rest = part.inner_radius + gap;
      if (!(at_rest * at_rest - edges_squared_.mean_sag_of_body[s] >
            part.outer_radius * part.outer_radius))
        return false;
    }
  }
  return true;
}

void RoundContacts::leave_out(std::vector<Body>& filters) const {
  for (const ObstaclePairs& obstacle : obstacles_) bullet::leave_out(obstacle, filters);
}

void RoundContacts::find_near(double separation, std::vector<Contact>& contacts) const {
  contacts.clear();
  for (const ObstaclePairs& obstacle : obstacles_) {
    for (const std::int32_t soft_body : obstacle.soft_bodies) {
      for (const RoundPart& part : topology_.bodies()[obstacle.body].triangles->round_parts)
        find_near(obstacle, soft_body, part, separation, contacts);
    }
  }
  std::sort(contacts.begin(), contacts.end());
}

void RoundContacts::find_near(const ObstaclePairs& obstacle, std::int32_t soft_body,
                              const RoundPart& part, double separation,
                              std::vector<Contact>& contacts) const {
  constexpr int max_advances = 16;
  const StepTopology::BodyRecord& rigid_record = topology_.bodies()[obstacle.body];
  const StepTopology::BodyRecord& soft = topology_.bodies()[soft_body];
  const RigidMotion& rigid = motion_.rigid_of(obstacle.body);
  const Topology topology = topology_.topology();
  const MovingCore core(part, rigid, false);
  const double near_distance = part.outer_radius + separation;
  for (std::int32_t v = soft.first_vertex; v < soft.first_vertex + soft.vertex_count; ++v) {
    const Vector3d x0 = motion_.start_of(v), x1 = motion_.end_of(v);
    const double move = core.relative_move(x0, x1), start_distance = core.distance(x0, 0);
    if (start_distance - move > near_distance || start_distance < part.inner_radius) continue;
    // Conservative advancement to the first time within the separation.
    double t = 0, distance = start_distance;
    for (int i = 0; i < max_advances && distance > near_distance && t < 1; ++i) {
      t = std::min(1.0, t + (distance - near_distance) / move);
      distance = core.distance((1 - t) * x0 + t * x1, t);
    }
    if (t == 1 && distance > near_distance) continue;
    const Vector3d x = (1 - t) * x0 + t * x1;
    Vector3d point;
    const auto along = static_cast<btScalar>(core.closest(x, t, point));
    const Vector3d normal = (x - point).normalized();
    const btVector3 local_normal =
        rigid.start.getBasis().transpose() * btVector3(to_bullet(normal));
    const btVector3 local_point = part.core[0].lerp(part.core[1], along);
    const FacePoint exit = find_exit(part, local_point, local_normal);

    Contact contact;
    contact.kind = ContactKind::vertex_face;
    contact.body_a = soft_body;
    contact.body_b = obstacle.body;
    contact.primitive_a = v;
    contact.primitive_b = rigid_record.first_face + part.first_face + exit.face;
    const Face& face = topology.faces[static_cast<std::size_t>(contact.primitive_b)];
    contact.vertices = {v, face[0], face[1], face[2]};
    contact.u = static_cast<float>(exit.u);
    contact.v = static_cast<float>(exit.v);
    for (int k = 0; k < 3; ++k) contact.normal[k] = static_cast<float>(normal[k]);
    contact.toi = t;
    contacts.push_back(contact);
  }
}

bool RoundContacts::are_clear(bool at_start) {
  if (!any()) return true;
  measure_edges_squared(topology_, motion_, at_start, edges_squared_);
  return std::all_of(obstacles_.begin(), obstacles_.end(),
                     [&](const ObstaclePairs& obstacle) { return is_clear(obstacle, at_start); });
}

bool RoundContacts::is_clear(const ObstaclePairs& obstacle, bool at_start) {
  const RigidMotion& rigid = motion_.rigid_of(obstacle.body);
  for (const RoundPart& part : topology_.bodies()[obstacle.body].triangles->round_parts) {
    for (const std::int32_t soft_body : obstacle.soft_bodies)
      if (!is_clear(soft_body, part, rigid, at_start)) return false;
  }
  return true;
}

bool RoundContacts::is_clear(std::int32_t soft_body, const RoundPart& part,
                             const RigidMotion& rigid, bool at_start) {
  const StepTopology::BodyRecord& soft = topology_.bodies()[soft_body];
  const std::int32_t first = soft.first_vertex, last = first + soft.vertex_count;
  const MovingCore core(part, rigid, at_start);
  const double radius = part.outer_radius + core.rounding(part.outer_radius);
  limits_.resize(static_cast<std::size_t>(soft.vertex_count));
  for (std::int32_t v = first; v < last; ++v) {
    const Vector3d x0 = motion_.start_of(v), x1 = at_start ? x0 : motion_.end_of(v);
    const double distance = core.smallest_distance(x0, x1);
    if (!(distance > radius)) return false;
    limits_[v - first] = distance * distance - radius * radius;
  }
  const double smallest = *std::min_element(limits_.begin(), limits_.end());
  if (smallest > edges_squared_.of_body[soft_body] / 3) return true;
  const auto all_within = [&](const auto& primitives, const std::vector<double>& sags) {
    for (std::size_t i = 0; i < sags.size(); ++i) {
      if (primitives[i][0] < first || primitives[i][0] >= last) continue;
      for (const std::int32_t v : primitives[i])
        if (!(limits_[v - first] > sags[i])) return false;
    }
    return true;
  };
  const Topology topology = topology_.topology();
  return all_within(topology.faces, edges_squared_.sag_of_face) &&
         all_within(topology.edges, edges_squared_.sag_of_edge);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
