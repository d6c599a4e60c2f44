#include "obstacles/round_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// What starts inside of the part is left to others.
bool starts_inside(const RoundPart& part, double time, const ClosestPoints& points) {
  return points.distance == 0 || (time == 0 && points.distance < part.inner_radius);
}

}  // namespace

// What rests at the kept distance from the triangles must be outside of the outer radius.
bool RoundContacts::may_be_met(const ObstaclePairs& obstacle) const {
  const Triangles& triangles = *topology_.bodies()[obstacle.body].triangles;
  for (const std::int32_t s : obstacle.soft_bodies)
    for (const RoundPart& part : triangles.round_parts)
      if (!(kept_distance(s, obstacle.body, part) > part.outer_radius)) return false;
  return true;
}

void RoundContacts::set_obstacles(const std::vector<ObstaclePairs>& obstacles) {
  obstacles_.clear();
  for (const ObstaclePairs& obstacle : obstacles)
    if (!topology_.bodies()[obstacle.body].triangles->round_parts.empty())
      obstacles_.push_back(obstacle);
  reach_.clear();
  if (obstacles_.empty()) return;
  for (std::int32_t body = 0; topology_.bodies()[body].soft; ++body)
    reach_.push_back(settings::simple_shapes::reach_in_radii *
                     std::sqrt(largest_sag(topology_, body, motion_, true)));
}

void RoundContacts::give_up(std::int32_t body) {
  obstacles_.erase(std::remove_if(obstacles_.begin(), obstacles_.end(),
                                  [body](const ObstaclePairs& o) { return o.body == body; }),
                   obstacles_.end());
}

// From the core, metres: what the response leaves of it at rest.
double RoundContacts::kept_distance(std::int32_t soft_body, std::int32_t obstacle,
                                    const RoundPart& part) const {
  return part.inner_radius +
         settings::simple_shapes::kept_thickness * surfaces_.of(soft_body, obstacle).thickness;
}

void RoundContacts::find_near(double separation, std::vector<Contact>& contacts) {
  contacts.clear();
  for (const ObstaclePairs& obstacle : obstacles_) {
    for (const RoundPart& part : topology_.bodies()[obstacle.body].triangles->round_parts) {
      const MovingCore core(part, motion_.rigid_of(obstacle.body), false);
      for (const std::int32_t soft_body : obstacle.soft_bodies)
        find_near({soft_body, obstacle.body, part, core}, separation, contacts);
    }
  }
  if (!std::is_sorted(contacts.begin(), contacts.end()))
    std::sort(contacts.begin(), contacts.end());
}

void RoundContacts::find_near(const Pair& pair, double separation, std::vector<Contact>& contacts) {
  const StepTopology::BodyRecord& soft = topology_.bodies()[pair.soft_body];
  const double near_distance = pair.part.outer_radius + separation;
  const NearPrimitives& near =
      soft_bounds_.find_near(pair.soft_body, pair.core.bounds(), near_distance);
  by_vertex_.resize(static_cast<std::size_t>(soft.vertex_count));
  double nearest = std::numeric_limits<double>::infinity();
  for (const std::int32_t v : near.vertices) {
    const Vector3d x0 = motion_.start_of(v), x1 = motion_.end_of(v);
    double& least = by_vertex_[v - soft.first_vertex];
    least = pair.core.distance(x0, 0) - pair.core.relative_move(x0, x1);
    nearest = std::min(nearest, least);
    if (least > near_distance) continue;
    double time;
    ClosestPoints points;
    if (pair.core.find_near({{x0}, 1}, {{x1}, 1}, near_distance, time, points) &&
        !starts_inside(pair.part, time, points))
      contacts.push_back(vertex_contact(pair, v, time, points));
  }
  if (nearest - reach_[pair.soft_body] > near_distance) return;
  const Topology topology = topology_.topology();
  find_near(pair, near_distance, topology.faces, near.faces, first_side_index(topology), contacts);
  find_near(pair, near_distance, topology.edges, near.edges, first_edge_index(topology), contacts);
}

RoundContacts::Exit RoundContacts::exit_of(const Pair& pair, const ClosestPoints& points) const {
  const RigidMotion& rigid = motion_.rigid_of(pair.obstacle);
  const Vector3d normal = points.between.normalized();
  const btVector3 local_normal = rigid.start.getBasis().transpose() * btVector3(to_bullet(normal));
  const auto along = static_cast<btScalar>(points.along);
  const btVector3 local_point = pair.part.core[0].lerp(pair.part.core[1], along);
  const FacePoint at = find_exit(pair.part, local_point, local_normal);
  const std::int32_t face =
      topology_.bodies()[pair.obstacle].faces.first + pair.part.first_face + at.face;
  return {normal, face, topology_.topology().faces[static_cast<std::size_t>(face)], at.u, at.v};
}

Contact RoundContacts::vertex_contact(const Pair& pair, std::int32_t vertex, double time,
                                      const ClosestPoints& points) const {
  const Exit exit = exit_of(pair, points);
  Contact contact;
  contact.kind = ContactKind::vertex_face;
  contact.body_a = pair.soft_body;
  contact.body_b = pair.obstacle;
  contact.primitive_a = vertex;
  contact.primitive_b = exit.face;
  contact.vertices = {vertex, exit.corners[0], exit.corners[1], exit.corners[2]};
  contact.u = static_cast<float>(exit.u);
  contact.v = static_cast<float>(exit.v);
  set_normal(exit.normal, contact);
  contact.toi = time;
  return contact;
}

// A contact has four vertices, so the obstacle's point moves to the vertex or edge next to it.
template <class Primitive>
Contact RoundContacts::contact_at(const Pair& pair, const Primitive& primitive, std::int32_t index,
                                  std::int32_t first_edge_index, double time,
                                  const ClosestPoints& points) const {
  // The selector looks at contacts of time 0 again, with their points as they are represented.
  constexpr double smallest_time = 0x1p-32;  // far more than rounding
  const auto smallest_of = [](const std::array<double, 3>& weights) {
    return static_cast<int>(std::min_element(weights.begin(), weights.end()) - weights.begin());
  };
  const Exit exit = exit_of(pair, points);
  const std::array<double, 3> exit_weights = {1.0 - exit.u - exit.v, exit.u, exit.v};
  const std::array<double, 3>& weights = points.weights;
  Contact contact;
  contact.toi = std::max(time, smallest_time);
  if (primitive.size() == 3 && weights[smallest_of(weights)] > 0) {
    const auto corner = std::max_element(exit_weights.begin(), exit_weights.end());
    const std::int32_t vertex = exit.corners[corner - exit_weights.begin()];
    contact.kind = ContactKind::vertex_face;
    contact.body_a = pair.obstacle;
    contact.body_b = pair.soft_body;
    contact.primitive_a = vertex;
    contact.primitive_b = index;
    contact.vertices = {vertex, primitive[0], primitive[1], primitive[2]};
    contact.u = static_cast<float>(weights[1]);
    contact.v = static_cast<float>(weights[2]);
    set_normal(-exit.normal, contact);
    return contact;
  }
  // Each edge is the side opposite to the corner without weight.
  const int side = primitive.size() == 3 ? smallest_of(weights) : 2;
  const int a = (side + 1) % 3, b = (side + 2) % 3;
  const int exit_side = smallest_of(exit_weights);
  const int c = (exit_side + 1) % 3, d = (exit_side + 2) % 3;
  contact.kind = ContactKind::edge_edge;
  contact.body_a = pair.soft_body;
  contact.body_b = pair.obstacle;
  contact.primitive_a = first_edge_index + (primitive.size() == 3 ? 3 * index + side : index);
  contact.primitive_b = 3 * exit.face + exit_side;
  contact.vertices = {primitive[a], primitive[b], exit.corners[c], exit.corners[d]};
  contact.u = static_cast<float>(weights[b] / (weights[a] + weights[b]));
  contact.v = static_cast<float>(exit_weights[d] / (exit_weights[c] + exit_weights[d]));
  set_normal(exit.normal, contact);
  return contact;
}

// Faces and edges that the constraints of their vertices do not keep clear.
template <class Primitives>
void RoundContacts::find_near(const Pair& pair, double near_distance, const Primitives& primitives,
                              const std::vector<std::int32_t>& indices,
                              std::int32_t first_edge_index, std::vector<Contact>& contacts) const {
  const std::int32_t first = topology_.bodies()[pair.soft_body].first_vertex;
  const double kept = kept_distance(pair.soft_body, pair.obstacle, pair.part);
  const double kept_sag = kept * kept - pair.part.outer_radius * pair.part.outer_radius;
  for (const std::int32_t i : indices) {
    const auto& primitive = primitives[i];
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::int32_t v : primitive) nearest = std::min(nearest, by_vertex_[v - first]);
    if (nearest - reach_[pair.soft_body] > near_distance) continue;
    const double sag = sag_of(primitive, motion_, true);
    if (!(sag > kept_sag) || nearest - std::sqrt(sag) > near_distance) continue;
    double time;
    ClosestPoints points;
    if (!pair.core.find_near(points_of(primitive, motion_, true),
                             points_of(primitive, motion_, false), near_distance, time, points) ||
        starts_inside(pair.part, time, points) ||
        *std::max_element(points.weights.begin(), points.weights.end()) >
            settings::simple_shapes::vertex_weight)
      continue;
    contacts.push_back(contact_at(pair, primitive, i, first_edge_index, time, points));
  }
}

void RoundContacts::find_unclear(bool at_start, std::vector<std::int32_t>& unclear) {
  for (const ObstaclePairs& obstacle : obstacles_)
    if (!is_clear(obstacle, at_start)) unclear.push_back(obstacle.body);
}

bool RoundContacts::is_clear(const ObstaclePairs& obstacle, bool at_start) {
  for (const RoundPart& part : topology_.bodies()[obstacle.body].triangles->round_parts) {
    const MovingCore core(part, motion_.rigid_of(obstacle.body), at_start);
    for (const std::int32_t soft_body : obstacle.soft_bodies)
      if (!is_clear({soft_body, obstacle.body, part, core}, at_start)) return false;
  }
  return true;
}

bool RoundContacts::is_clear(const Pair& pair, bool at_start) {
  const StepTopology::BodyRecord& soft = topology_.bodies()[pair.soft_body];
  const std::int32_t first = soft.first_vertex;
  const double radius = pair.part.outer_radius + pair.core.rounding(pair.part.outer_radius);
  const NearPrimitives& near = soft_bounds_.find_near(pair.soft_body, pair.core.bounds(), radius);
  if (near.empty()) return true;
  filter_.find_anchored(pair.soft_body, pair.obstacle, anchored_);
  const auto is_anchored = [this](std::int32_t v) {
    return std::binary_search(anchored_.begin(), anchored_.end(), v);
  };
  by_vertex_.resize(static_cast<std::size_t>(soft.vertex_count));
  for (const std::int32_t v : near.vertices) {
    if (is_anchored(v)) {
      by_vertex_[v - first] = std::numeric_limits<double>::infinity();
      continue;
    }
    const Vector3d x0 = motion_.start_of(v), x1 = at_start ? x0 : motion_.end_of(v);
    const double distance = pair.core.smallest_distance(x0, x1);
    if (!(distance > radius)) return false;
    by_vertex_[v - first] = distance * distance - radius * radius;
  }
  const auto is_primitive_clear = [&](const auto& primitive) {
    double smallest = std::numeric_limits<double>::infinity();
    for (const std::int32_t v : primitive) smallest = std::min(smallest, by_vertex_[v - first]);
    return smallest > sag_of(primitive, motion_, at_start) ||
           pair.core.is_farther(radius, points_of(primitive, motion_, true),
                                points_of(primitive, motion_, at_start));
  };
  const bool any_embedded_edges = filter_.any_embedded_edges();
  const auto is_ignored = [&](const auto& primitive) {
    return std::any_of(primitive.begin(), primitive.end(), is_anchored) ||
           (any_embedded_edges &&
            filter_.is_embedded({primitive.data(), primitive.size()}, pair.obstacle));
  };
  // Of a face whose contacts are ignored, those of its sides may count.
  const auto are_sides_clear = [&](const auto& primitive) {
    if (primitive.size() < 3) return true;
    for (std::size_t i = 0; i < 3; ++i) {
      const Edge side = {primitive[i], primitive[(i + 1) % 3]};
      if (!is_ignored(side) && !is_primitive_clear(side)) return false;
    }
    return true;
  };
  const auto are_all_clear = [&](const auto& primitives, const std::vector<std::int32_t>& indices) {
    return std::all_of(indices.begin(), indices.end(), [&](std::int32_t i) {
      const auto& primitive = primitives[i];
      return is_ignored(primitive) ? are_sides_clear(primitive) : is_primitive_clear(primitive);
    });
  };
  const Topology topology = topology_.topology();
  return are_all_clear(topology.faces, near.faces) && are_all_clear(topology.edges, near.edges);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
