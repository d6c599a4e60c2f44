#include "touching/touching_sides.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "settings.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// The vertices of one side of a pair: those before or from first_vertex_of_b().
std::pair<std::size_t, std::size_t> side_of(const TouchingPair& pair, bool is_a) {
  const auto of_a = static_cast<std::size_t>(first_vertex_of_b(pair.contact.kind));
  return is_a ? std::make_pair(std::size_t{0}, of_a) : std::make_pair(of_a, std::size_t{4});
}

Vector3d point_of(const TouchingPair& pair, bool is_a, const Motion& motion) {
  Vector3d point = Vector3d::Zero();
  const auto [first, last] = side_of(pair, is_a);
  for (std::size_t i = first; i < last; ++i)
    point += std::abs(pair.weights[i]) * motion.start_of(pair.contact.vertices[i]);
  return point;
}

// Velocity of a vertex at the end of the step, m/s. Differences of positions would have the
// rounding of places far from the origin.
Vector3d velocity_of(std::int32_t v, const StepTopology& topology, const Motion& motion) {
  if (motion.is_soft(v)) return motion.velocity()[v];
  return motion.rigid_of(topology.body_of(v)).velocity_at(motion.start_of(v));
}

Vector3d velocity_of(const TouchingPair& pair, bool is_a, const StepTopology& topology,
                     const Motion& motion) {
  Vector3d velocity = Vector3d::Zero();
  const auto [first, last] = side_of(pair, is_a);
  for (std::size_t i = first; i < last; ++i)
    velocity += std::abs(pair.weights[i]) * velocity_of(pair.contact.vertices[i], topology, motion);
  return velocity;
}

Vector3d mean_velocity_of(std::int32_t body, const StepTopology& topology, const Motion& motion) {
  const StepTopology::BodyRecord& record = topology.bodies()[body];
  Vector3d sum = Vector3d::Zero();
  for (std::int32_t i = 0; i < record.vertex_count; ++i)
    sum += velocity_of(record.first_vertex + i, topology, motion);
  return record.vertex_count > 0 ? sum / record.vertex_count : sum;
}

// The direction that is perpendicular to two edges. Zero if they are parallel but for the rounding
// of their ends.
Vector3d across(const Vector3d& e1, const Vector3d& e2, double rounding) {
  const Vector3d normal = e1.cross(e2);
  const double longest = std::max(e1.norm(), e2.norm());
  return normal.norm() > rounding * longest ? normal.normalized() : Vector3d::Zero();
}

// A unit vector perpendicular to an edge.
Vector3d across(const Vector3d& edge) {
  int axis;
  edge.cwiseAbs().minCoeff(&axis);
  return edge.cross(Vector3d(Vector3d::Unit(axis))).normalized();
}

// Sets of pairs that are of the same two bodies and share vertices.
DisjointSets find_patches(const std::vector<TouchingPair>& pairs,
                          const std::vector<std::size_t>& indices) {
  DisjointSets patches(indices.size());
  std::map<std::array<std::int32_t, 3>, std::int32_t> seen;  // vertex and both bodies
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Contact& contact = pairs[indices[i]].contact;
    const auto [low, high] = std::minmax(contact.body_a, contact.body_b);
    for (const std::int32_t v : contact.vertices) {
      const auto [entry, is_new] = seen.insert({{v, low, high}, static_cast<std::int32_t>(i)});
      if (!is_new) patches.join(entry->second, static_cast<std::int32_t>(i));
    }
  }
  return patches;
}

}  // namespace

const OrientedSurface& TouchingSides::surface_of(std::int32_t body) {
  const auto found = surfaces_.find(body);
  if (found != surfaces_.end()) return found->second;
  return surfaces_.emplace(body, OrientedSurface(topology_, motion_, body)).first->second;
}

OrientedSurface::Normal TouchingSides::surface_at(const TouchingPair& pair, bool is_a) {
  const std::int32_t body = is_a ? pair.contact.body_a : pair.contact.body_b;
  const IndexRange faces = topology_.bodies()[body].faces;
  if (faces.first == faces.last) return {};
  const OrientedSurface& surface = surface_of(body);
  const auto [first, last] = side_of(pair, is_a);
  std::vector<std::int32_t> at;  // the vertices that have a weight
  for (std::size_t i = first; i < last; ++i)
    if (pair.weights[i] != 0) at.push_back(pair.contact.vertices[i]);
  if (at.size() == 3) return surface.of_face(pair.contact.primitive_b);
  return at.size() == 2 ? surface.of_edge(at[0], at[1]) : surface.of_vertex(at[0]);
}

// Two solids that are both outside of each other have opposite normals. Where they agree, one is
// inside of the other, and their sides are those of sheets.
Vector3d TouchingSides::normal_of_solid(const Normal& of_a, const Normal& of_b) {
  Vector3d outward = Vector3d::Zero();
  if (of_a.is_of_solid && of_b.is_of_solid && of_a.direction.dot(of_b.direction) > 0)
    return outward;
  if (of_b.is_of_solid) outward += of_b.direction;
  if (of_a.is_of_solid) outward -= of_a.direction;
  return outward.isZero() ? outward : outward.normalized();
}

Vector3d TouchingSides::reference_of(const TouchingPair& pair, const Normal& of_a,
                                     const Normal& of_b, double bound) const {
  const bool a_is_first = pair.contact.body_a < pair.contact.body_b;
  const Vector3d of_first = a_is_first ? of_a.direction : of_b.direction;
  const Vector3d of_second = a_is_first ? of_b.direction : of_a.direction;
  if (!of_second.isZero()) return of_second;
  if (!of_first.isZero()) return -of_first;
  const auto x = [&](std::size_t i) { return motion_.start_of(pair.contact.vertices[i]); };
  const Vector3d first = x(1) - x(0), of_crossing = across(first, x(3) - x(2), bound);
  return of_crossing.isZero() ? across(first) : of_crossing;
}

const Vector3d& TouchingSides::mean_velocity(std::int32_t body) {
  const auto found = mean_velocities_.find(body);
  if (found != mean_velocities_.end()) return found->second;
  return mean_velocities_.emplace(body, mean_velocity_of(body, topology_, motion_)).first->second;
}

const std::vector<std::int32_t>& TouchingSides::neighbours_of(std::int32_t vertex) {
  const auto [entry, is_new] = neighbours_.try_emplace(vertex);
  std::vector<std::int32_t>& neighbours = entry->second;
  if (!is_new) return neighbours;
  const StepTopology::BodyRecord& body = topology_.bodies()[topology_.body_of(vertex)];
  if (body.faces.first != body.faces.last) {
    for (const std::int32_t f : surface_of(topology_.index_of(body)).faces_around(vertex))
      for (const std::int32_t v : topology_.topology().faces[f])
        if (v != vertex) neighbours.push_back(v);
    return neighbours;
  }
  for (std::int32_t e = body.edges.first; e < body.edges.last; ++e) {
    const Edge& edge = topology_.topology().edges[e];
    if (edge[0] == vertex) neighbours.push_back(edge[1]);
    if (edge[1] == vertex) neighbours.push_back(edge[0]);
  }
  return neighbours;
}

double TouchingSides::height_of_neighbours(const TouchingPair& pair, bool is_a,
                                           const Vector3d& up) {
  const double at = up.dot(point_of(pair, is_a, motion_));
  const auto [first, last] = side_of(pair, is_a);
  double sum = 0, count = 0;
  for (std::size_t i = first; i < last; ++i) {
    if (pair.weights[i] == 0) continue;
    for (const std::int32_t v : neighbours_of(pair.contact.vertices[i])) {
      sum += up.dot(motion_.start_of(v)) - at;
      ++count;
    }
  }
  return count > 0 ? sum / count : 0;
}

void TouchingSides::add_votes(const TouchingPair& pair, const Vector3d& reference, double bound,
                              Votes& votes) {
  const Contact& contact = pair.contact;
  const Vector3d up = contact.body_a < contact.body_b ? reference : -reference;
  votes.gap += up.dot(pair.gap);
  votes.bound += bound;
  votes.neighbours += height_of_neighbours(pair, true, up) - height_of_neighbours(pair, false, up);
  votes.velocity -= up.dot(velocity_of(pair, true, topology_, motion_) -
                           velocity_of(pair, false, topology_, motion_) +
                           mean_velocity(contact.body_a) - mean_velocity(contact.body_b));
}

std::vector<Vector3d> TouchingSides::normals_of(const std::vector<TouchingPair>& pairs,
                                                const Bound& bound) {
  std::vector<Vector3d> normals(pairs.size(), Vector3d::Zero());
  std::vector<std::size_t> sheets;  // indices of the pairs whose side no solid decides
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Normal of_a = surface_at(pairs[i], true), of_b = surface_at(pairs[i], false);
    normals[i] = normal_of_solid(of_a, of_b);
    if (!normals[i].isZero()) continue;
    normals[i] = reference_of(pairs[i], of_a, of_b, bound(pairs[i], Vector3d::Ones()));
    sheets.push_back(i);
  }
  DisjointSets patches = find_patches(pairs, sheets);
  const auto patch_of = [&patches](std::size_t i) {
    return static_cast<std::size_t>(patches.find(static_cast<std::int32_t>(i)));
  };
  std::vector<Votes> votes(sheets.size());  // by patch
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    const TouchingPair& pair = pairs[sheets[i]];
    const Vector3d& reference = normals[sheets[i]];
    add_votes(pair, reference, bound(pair, reference), votes[patch_of(i)]);
  }
  for (std::size_t i = 0; i < sheets.size(); ++i) {
    const Contact& contact = pairs[sheets[i]].contact;
    if (votes[patch_of(i)].first_is_ahead() != (contact.body_a < contact.body_b))
      normals[sheets[i]] = -normals[sheets[i]];
  }
  return normals;
}

// What was parted before has gaps of the whole bound.
bool TouchingSides::Votes::first_is_ahead() const {
  if (std::abs(gap) > settings::touching::parted_fraction * bound) return gap > 0;
  if (std::abs(neighbours) > bound) return neighbours > 0;
  return velocity >= 0;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
