#include "detection/flat_contacts.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// With more pairs of a vertex and a part, the detector's hierarchy is faster.
constexpr std::int64_t max_pairs = 1 << 15;
// An obstacle is given up after so many motions in succession in which it was not clear.
constexpr int max_unclear_motions = 3;
// Relative to the coordinates: more than the rounding of a dot product.
constexpr double rounding = 0x1p-48;

bool are_opposite(const Vector3d& a, const Vector3d& b) { return a.dot(b) < -0.5; }

}  // namespace

void FlatContacts::set_topology() {
  obstacles_.clear();
  std::int64_t pairs = 0;
  for (ObstaclePairs& obstacle : find_obstacle_pairs(topology_)) {
    const Triangles& triangles = *topology_.bodies()[obstacle.body].triangles;
    const RigidMotion& rigid = motion_.rigid_of(obstacle.body);
    if (!triangles.is_flat() || rigid.is_movable() || rigid.local_at_start) continue;
    const auto responds = [this](std::int32_t s) { return topology_.bodies()[s].responds; };
    if (!std::all_of(obstacle.soft_bodies.begin(), obstacle.soft_bodies.end(), responds)) continue;
    for (const std::int32_t s : obstacle.soft_bodies)
      pairs += static_cast<std::int64_t>(triangles.flat_parts.size()) *
               topology_.bodies()[s].vertex_count;
    obstacles_.push_back({std::move(obstacle)});
  }
  if (pairs > max_pairs) clear();
}

void FlatContacts::leave_out(std::vector<Body>& filters) const {
  for (const Obstacle& obstacle : obstacles_) bullet::leave_out(obstacle.pairs, filters);
}

void FlatContacts::set_sides(const ObstaclePairs& obstacle, const FlatPart& part, bool at_start) {
  const RigidMotion& rigid = motion_.rigid_of(obstacle.body);
  sides_.clear();
  for (const FlatPart::Side& side : part.sides) {
    const Vector3d normal = to_eigen(rigid.start.getBasis() * side.normal).normalized();
    MovingSide moving{normal, -std::numeric_limits<double>::infinity(),
                      -std::numeric_limits<double>::infinity(), &side};
    double largest = 0;
    for (std::int32_t i = part.first_vertex; i < part.vertex_end; ++i) {
      const std::int32_t v = rigid.first_vertex + i;
      const Vector3d start = motion_.start_of(v), end = at_start ? start : motion_.end_of(v);
      moving.start = std::max(moving.start, normal.dot(start));
      moving.end = std::max(moving.end, normal.dot(end));
      largest = std::max({largest, start.lpNorm<1>(), end.lpNorm<1>()});
    }
    moving.start += rounding * largest;
    moving.end += rounding * largest;
    sides_.push_back(moving);
  }
}

bool FlatContacts::find_near(double separation, std::vector<Contact>& contacts) {
  contacts.clear();
  if (!any()) return true;
  longest_edges_.assign(topology_.bodies().size(), -1);
  const auto suits = [&](const ObstaclePairs& pairs) {
    const std::size_t first = contacts.size();
    for (const FlatPart& part : topology_.bodies()[pairs.body].triangles->flat_parts) {
      set_sides(pairs, part, false);
      for (const std::int32_t s : pairs.soft_bodies) {
        if (longest_edges_[s] < 0) longest_edges_[s] = longest_edge(topology_, s, motion_);
        if (find_near(pairs, s, separation, longest_edges_[s], contacts)) continue;
        contacts.resize(first);
        return false;
      }
    }
    return true;
  };
  const auto given_up = std::remove_if(obstacles_.begin(), obstacles_.end(), [&](Obstacle& o) {
    o.unclear_motions = o.was_clear ? 0 : o.unclear_motions + 1;
    o.was_clear = true;
    return o.unclear_motions >= max_unclear_motions || !suits(o.pairs);
  });
  const bool kept_all = given_up == obstacles_.end();
  obstacles_.erase(given_up, obstacles_.end());
  std::sort(contacts.begin(), contacts.end());
  return kept_all;
}

// Returns false if a vertex is near an edge of the part, or starts inside of it. A vertex that is
// in front of one side, and an edge's length or more behind the sides around it, has only
// neighbours that are behind them too.
bool FlatContacts::find_near(const ObstaclePairs& obstacle, std::int32_t soft_body,
                             double separation, double longest_edge,
                             std::vector<Contact>& contacts) const {
  const StepTopology::BodyRecord& soft = topology_.bodies()[soft_body];
  const MovingSide* met = nullptr;  // the only side that this body may be near to
  for (std::int32_t v = soft.first_vertex; v < soft.first_vertex + soft.vertex_count; ++v) {
    const Vector3d x0 = motion_.start_of(v), x1 = motion_.end_of(v);
    const auto at_start = [&x0](const MovingSide& s) { return s.normal.dot(x0) - s.start; };
    const auto at_end = [&x1](const MovingSide& s) { return s.normal.dot(x1) - s.end; };
    const auto is_far_from = [&](const MovingSide& s) {
      return std::min(at_start(s), at_end(s)) > separation + longest_edge;
    };
    if (std::any_of(sides_.begin(), sides_.end(), is_far_from)) continue;
    const auto front = std::find_if(sides_.begin(), sides_.end(),
                                    [&](const MovingSide& s) { return at_start(s) > 0; });
    if (front == sides_.end() || (met && met != &*front)) return false;
    met = &*front;
    for (const MovingSide& side : sides_) {
      if (&side == met || are_opposite(side.normal, met->normal)) continue;
      if (!(std::max(at_start(side), at_end(side)) <= -longest_edge)) return false;
    }
    const double start_gap = at_start(*met), end_gap = at_end(*met);
    if (!(std::min(start_gap, end_gap) <= separation)) continue;
    const double time =
        start_gap <= separation ? 0 : (start_gap - separation) / (start_gap - end_gap);
    Contact contact = contact_at(obstacle, v, *met, time);
    contact.body_a = soft_body;
    contacts.push_back(contact);
  }
  return true;
}

Contact FlatContacts::contact_at(const ObstaclePairs& obstacle, std::int32_t vertex,
                                 const MovingSide& side, double time) const {
  const auto at_time = [&](std::int32_t v) -> Vector3d {
    return (1 - time) * motion_.start_of(v) + time * motion_.end_of(v);
  };
  const Topology topology = topology_.topology();
  const Vector3d x = at_time(vertex);
  Contact contact;
  contact.kind = ContactKind::vertex_face;
  contact.body_b = obstacle.body;
  contact.primitive_a = vertex;
  contact.toi = time;
  double best = -std::numeric_limits<double>::infinity();
  for (const std::int32_t f : side.side->faces) {
    const std::int32_t index = topology_.bodies()[obstacle.body].faces.first + f;
    const Face& face = topology.faces[static_cast<std::size_t>(index)];
    const Vector3d a = at_time(face[0]), ab = at_time(face[1]) - a, ac = at_time(face[2]) - a;
    const Vector3d across = ab.cross(ac);
    const double area = across.squaredNorm();
    if (!(area > 0)) continue;
    const double u = across.dot((x - a).cross(ac)) / area, v = across.dot(ab.cross(x - a)) / area;
    const double inside = std::min({u, v, 1 - u - v});
    if (inside <= best) continue;
    best = inside;
    contact.primitive_b = index;
    contact.vertices = {vertex, face[0], face[1], face[2]};
    contact.u = static_cast<float>(std::clamp(u, 0.0, 1.0));
    contact.v = static_cast<float>(std::clamp(v, 0.0, 1 - static_cast<double>(contact.u)));
  }
  for (int k = 0; k < 3; ++k) contact.normal[k] = static_cast<float>(side.normal[k]);
  return contact;
}

bool FlatContacts::are_clear(bool at_start) {
  bool all_clear = true;
  for (Obstacle& obstacle : obstacles_) {
    if (is_clear(obstacle.pairs, at_start)) continue;
    if (!at_start) obstacle.was_clear = false;
    all_clear = false;
  }
  return all_clear;
}

bool FlatContacts::is_clear(const ObstaclePairs& obstacle, bool at_start) {
  for (const FlatPart& part : topology_.bodies()[obstacle.body].triangles->flat_parts) {
    set_sides(obstacle, part, at_start);
    for (const std::int32_t soft_body : obstacle.soft_bodies)
      if (!is_clear(soft_body, at_start)) return false;
  }
  return true;
}

// Each face and each edge must be in front of one of the sides. Mostly it is the same for all.
bool FlatContacts::is_clear(std::int32_t soft_body, bool at_start) {
  const StepTopology::BodyRecord& soft = topology_.bodies()[soft_body];
  const std::int32_t first = soft.first_vertex, last = first + soft.vertex_count;
  const auto is_beyond = [&](std::int32_t v, const MovingSide& side) {
    const Vector3d x0 = motion_.start_of(v);
    const auto exceeds = [&side](const Vector3d& x, double reach) {
      return side.normal.dot(x) - rounding * x.lpNorm<1>() > reach;
    };
    return exceeds(x0, side.start) && (at_start || exceeds(motion_.end_of(v), side.end));
  };
  for (const MovingSide& side : sides_) {
    std::int32_t v = first;
    while (v < last && is_beyond(v, side)) ++v;
    if (v == last) return true;
  }
  beyond_.assign(static_cast<std::size_t>(soft.vertex_count), 0);
  for (std::int32_t v = first; v < last; ++v) {
    for (std::size_t s = 0; s < sides_.size(); ++s)
      beyond_[v - first] |= static_cast<std::uint32_t>(is_beyond(v, sides_[s])) << s;
  }
  const auto has_common_side = [&](const auto& primitive) {
    std::uint32_t common = ~0u;
    for (const std::int32_t v : primitive) common &= beyond_[v - first];
    return common != 0;
  };
  const auto all_have_one = [&](const auto& primitives, const IndexRange& range) {
    return std::all_of(primitives.begin() + range.first, primitives.begin() + range.last,
                       has_common_side);
  };
  const Topology topology = topology_.topology();
  return all_have_one(topology.faces, soft.faces) && all_have_one(topology.edges, soft.edges);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
