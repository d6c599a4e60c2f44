#include "untangling/untangling.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "settings.h"
#include "untangling/closed_surfaces.h"
#include "util/disjoint_sets.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Components into which the edges that intersect faces cut the surfaces.
class SurfaceComponents {
 public:
  SurfaceComponents(const std::vector<Intersection>& pairs, std::size_t vertices,
                    Span<const Edge> edges)
      : components_(vertices), surfaces_(vertices) {
    std::vector<char> intersects(edges.size(), 0);
    for (const Intersection& pair : pairs) intersects[pair.edge] = 1;
    for (std::size_t e = 0; e < edges.size(); ++e) {
      surfaces_.join(edges[e][0], edges[e][1]);
      if (!intersects[e]) components_.join(edges[e][0], edges[e][1]);
    }
    std::map<std::int32_t, int> size;
    for (std::size_t v = 0; v < vertices; ++v)
      ++size[components_.find(static_cast<std::int32_t>(v))];
    for (const auto& [component, count] : size) {
      std::int32_t& largest =
          largest_.try_emplace(surfaces_.find(component), component).first->second;
      if (count > size[largest]) largest = component;
    }
  }
  // The component of a vertex, as the index of one of its vertices.
  std::int32_t component_of(std::int32_t v) { return components_.find(v); }
  bool is_largest(std::int32_t component) {
    return largest_[surfaces_.find(component)] == component;
  }

 private:
  DisjointSets components_, surfaces_;
  std::map<std::int32_t, std::int32_t> largest_;  // largest component, by surface
};

// Decides which components are on the right side of other surfaces.
class Sides {
 public:
  Sides(const std::vector<Intersection>& pairs, const Topology& topology, Span<const Edge> edges,
        const ClosedSurfaces& closed, const Motion& motion)
      : topology_(topology),
        motion_(motion),
        components_(pairs, motion.size(), edges),
        closed_surfaces_(closed) {}

  // True if the vertex is on the right side of the face. The vertex belongs to an edge that
  // intersects the face.
  bool is_on_right_side(std::int32_t v, const Face& face) {
    const std::int32_t component = components_.component_of(v),
                       body = topology_.body_of_vertex[face[0]];
    if (topology_.body_of_vertex[v] == body || !closed_surfaces_.is_closed(body))
      return components_.is_largest(component);
    const auto [entry, is_new] = outside_.try_emplace({component, body}, true);
    if (is_new) entry->second = !closed_surfaces_.contains(body, motion_.start_of(v));
    return entry->second;
  }

 private:
  const Topology& topology_;
  const Motion& motion_;
  SurfaceComponents components_;
  const ClosedSurfaces& closed_surfaces_;
  // By component and body: the component is outside of the body.
  std::map<std::pair<std::int32_t, std::int32_t>, bool> outside_;
};

using FacesOfEdges = std::map<Edge, std::vector<Face>>;

Edge sorted(std::int32_t a, std::int32_t b) { return {std::min(a, b), std::max(a, b)}; }

FacesOfEdges faces_of_edges(const std::vector<Intersection>& pairs, const Topology& topology,
                            Span<const Edge> edges) {
  FacesOfEdges faces;
  for (const Intersection& pair : pairs) faces[sorted(edges[pair.edge][0], edges[pair.edge][1])];
  for (const Face& face : topology.faces) {
    for (int k = 0; k < 3; ++k) {
      const auto edge = faces.find(sorted(face[k], face[(k + 1) % 3]));
      if (edge != faces.end()) edge->second.push_back(face);
    }
  }
  return faces;
}

// Depth of a penetration, metres.
double depth_of(const Contact& contact, const Motion& motion) {
  const Vector3d normal(contact.normal[0], contact.normal[1], contact.normal[2]);
  const std::array<double, 4> weights = contact.weights();
  double depth = 0;
  for (std::size_t i = 0; i < 4; ++i)
    depth -= weights[i] * normal.dot(motion.start_of(contact.vertices[i]));
  return depth;
}

// By body: nonzero if impulses or pushes move some of it.
std::vector<char> find_movable_bodies(const Topology& topology, const Motion& motion) {
  std::vector<char> moves(topology.bodies.size(), 0);
  for (std::int32_t v = 0; v < motion.soft_count(); ++v)
    if (motion.is_movable(v)) moves[topology.body_of_vertex[v]] = 1;
  for (std::size_t body = 0; body < std::min(moves.size(), motion.rigid_of_body().size()); ++body) {
    const int rigid = motion.rigid_of_body()[body];
    if (rigid >= 0 && motion.rigid()[rigid].is_movable()) moves[body] = 1;
  }
  return moves;
}

Vector3d normal_of(const Face& face, const Motion& motion) {
  const Vector3d a = motion.start_of(face[0]);
  return (motion.start_of(face[1]) - a).cross(motion.start_of(face[2]) - a).normalized();
}

// Sum of the directions in which the line of intersection continues from the edge, in each of the
// faces that meet at the edge. The line lies in the plane with normal `normal`.
Vector3d contour_direction(const Edge& edge, const std::vector<Face>& faces, const Vector3d& normal,
                           const Motion& motion) {
  Vector3d sum = Vector3d::Zero();
  const Vector3d p = motion.start_of(edge[0]);
  const Vector3d along = (motion.start_of(edge[1]) - p).normalized();
  for (const Face& face : faces) {
    const Vector3d line = normal_of(face, motion).cross(normal).normalized();
    Vector3d inward = Vector3d::Zero();
    for (const std::int32_t v : face) {
      const Vector3d arm = motion.start_of(v) - p;
      inward += arm - arm.dot(along) * along;
    }
    sum += line.dot(inward) < 0 ? -line : line;
  }
  return sum;
}

}  // namespace

Untangling::Untangling() = default;
Untangling::~Untangling() = default;

void Untangling::finish() {
  if (!is_in_progress_) progress_.finish();
}

void Untangling::skip_step() {
  pushes_.clear();
  directions_.clear();
  penetrations_ = {};
  pairs_.clear();
  closed_surfaces_.reset();
}

void Untangling::begin_step(const Found& found, const Topology& topology, Span<const Edge> edges,
                            const Motion& motion) {
  read(found, topology, edges, motion, motion.dt());
}

void Untangling::read(const Found& found, const Topology& topology, Span<const Edge> edges,
                      const Motion& motion, double seconds) {
  skip_step();
  PairProgress::FoundPairs found_pairs;
  for (const Contact& contact : found.penetrations.contacts) {
    PairProgress::Found& pair = found_pairs[sorted(contact.body_a, contact.body_b)];
    ++pair.count;
    pair.depth += depth_of(contact, motion);
  }
  std::vector<Intersection> pairs;
  for (const Intersection& pair : found.intersections.pairs) {
    const Edge& edge = edges[pair.edge];
    const Face& face = topology.faces[pair.face];
    const bool soft_edge = motion.is_soft(edge[0]), soft_face = motion.is_soft(face[0]);
    if (!soft_edge && !soft_face) continue;
    const bool penetrates =
        (!soft_face && found.penetrations.contains({edge.data(), edge.size()},
                                                   topology.body_of_vertex[face[0]])) ||
        (!soft_edge &&
         found.penetrations.contains({face.data(), face.size()}, topology.body_of_vertex[edge[0]]));
    if (!penetrates) pairs.push_back(pair);
  }
  const auto bodies_of = [&](const Intersection& pair) {
    return sorted(topology.body_of_vertex[edges[pair.edge][0]],
                  topology.body_of_vertex[topology.faces[pair.face][0]]);
  };
  for (const Intersection& pair : pairs) ++found_pairs[bodies_of(pair)].count;
  const PairProgress::Groups groups =
      progress_.update(found_pairs, seconds, find_movable_bodies(topology, motion));
  is_in_progress_ = !groups.empty();
  if (!is_in_progress_) return;
  for (const auto& entry : groups) pairs_.push_back(entry.first);
  const auto is_given_up = [&](const Intersection& pair) {
    return groups.count(bodies_of(pair)) == 0;
  };
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), is_given_up), pairs.end());
  take_penetrations(found.penetrations, topology);
  if (pairs.empty()) return;
  closed_surfaces_ = std::make_unique<ClosedSurfaces>(topology, motion);
  Sides sides(pairs, topology, edges, *closed_surfaces_, motion);
  const FacesOfEdges faces = faces_of_edges(pairs, topology, edges);
  for (const Intersection& pair : pairs) {
    const Edge& edge = edges[pair.edge];
    const Face& face = topology.faces[pair.face];
    const Vector3d normal = normal_of(face, motion);
    const Vector3d along = (motion.start_of(edge[1]) - motion.start_of(edge[0])).normalized();
    const double across = along.dot(normal);
    const bool first_is_on_right_side = sides.is_on_right_side(edge[0], face);
    Vector3d direction;
    if (first_is_on_right_side != sides.is_on_right_side(edge[1], face)) {
      direction = (across > 0) == first_is_on_right_side ? -normal : normal;
    } else {
      const Vector3d line =
          contour_direction(edge, faces.at(sorted(edge[0], edge[1])), normal, motion);
      direction = line - 2 * along.dot(line) / across * normal;
      direction /= std::sqrt(1 + direction.squaredNorm());
    }
    if (direction.allFinite()) add(edge, face, direction, motion);
  }
  find_longest_pushes(groups, topology);
}

void Untangling::take_penetrations(const Penetrations& found, const Topology& topology) {
  const auto is_moved_apart = [&](std::int32_t vertex, std::int32_t body) {
    const BodyPair pair = sorted(topology.body_of_vertex[vertex], body);
    return std::binary_search(pairs_.begin(), pairs_.end(), pair);
  };
  for (const Contact& contact : found.contacts) {
    const BodyPair pair = sorted(contact.body_a, contact.body_b);
    if (std::binary_search(pairs_.begin(), pairs_.end(), pair))
      penetrations_.contacts.push_back(contact);
  }
  const auto take = [&](const auto& from, auto& to) {
    std::copy_if(from.begin(), from.end(), std::back_inserter(to), [&](const auto& primitive) {
      return is_moved_apart(primitive.front(), primitive.back());
    });
  };
  take(found.vertices, penetrations_.vertices);
  take(found.edges, penetrations_.edges);
  take(found.faces, penetrations_.faces);
}

void Untangling::find_longest_pushes(const PairProgress::Groups& groups, const Topology& topology) {
  std::map<std::int32_t, std::int32_t> group_of;  // by body
  for (const auto& [pair, group] : groups) {
    for (const std::int32_t body : pair) group_of[body] = group;
  }
  std::map<std::int32_t, double> longest;  // by group
  for (auto& [vertex, push] : pushes_) {
    double& of_group =
        longest.try_emplace(group_of.at(topology.body_of_vertex[vertex]), 1).first->second;
    of_group = std::max(of_group, push.displacement.norm());
  }
  for (auto& [vertex, push] : pushes_)
    push.longest = longest.at(group_of.at(topology.body_of_vertex[vertex]));
}

bool Untangling::moves_apart(std::int32_t body) const {
  return std::any_of(pairs_.begin(), pairs_.end(),
                     [body](const BodyPair& pair) { return pair[0] == body || pair[1] == body; });
}

void Untangling::add(const Edge& edge, const Face& face, const Vector& direction,
                     const Motion& motion) {
  // The point at which the edge passes through the face, relative to a.
  const Vector p = motion.start_of(edge[0]), along = motion.start_of(edge[1]) - p;
  const Vector a = motion.start_of(face[0]);
  const Vector ab = motion.start_of(face[1]) - a, ac = motion.start_of(face[2]) - a;
  const Vector area = ab.cross(ac);
  const double s = (a - p).dot(area) / along.dot(area);
  const Vector point = p + s * along - a;
  const double u = point.cross(ac).dot(area) / area.squaredNorm();
  const double v = ab.cross(point).dot(area) / area.squaredNorm();
  const std::array<std::int32_t, 5> vertices = {edge[0], edge[1], face[0], face[1], face[2]};
  const std::array<double, 5> weights = {1 - s, s, -(1 - u - v), -u, -v};
  std::array<double, 5> shares;
  double compliance = 0, max_inverse_mass = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    const double inverse_mass = motion.inverse_mass_of(vertices[i]);
    shares[i] = weights[i] * inverse_mass;
    compliance += weights[i] * shares[i];
    max_inverse_mass = std::max(max_inverse_mass, inverse_mass);
  }
  if (!(compliance > 0)) return;
  // With the bound a node of small weight is thrown no farther than in make_row().
  compliance = std::max(compliance, max_inverse_mass / settings::row::max_mass_ratio);
  const auto add_to = [](auto& sums, const auto& key, const Vector& summand) {
    sums.try_emplace(key, Vector::Zero()).first->second += summand;
  };
  for (std::size_t i = 0; i < 5; ++i) {
    if (shares[i] != 0) pushes_[vertices[i]].displacement += shares[i] / compliance * direction;
  }
  for (const std::int32_t e : edge) {
    for (const std::int32_t f : face) {
      add_to(directions_, std::make_pair(e, f), direction);
      add_to(directions_, std::make_pair(f, e), -direction);
    }
  }
}

void Untangling::push(double distance, Motion& motion) const {
  for (const auto& [vertex, push] : pushes_) {
    const Vector end = motion.end_of(vertex) + distance / push.longest * push.displacement;
    for (int k = 0; k < 3; ++k)
      motion.end[3 * static_cast<std::size_t>(vertex) + k] = static_cast<btScalar>(end[k]);
  }
}

// True if the contact would stop a vertex or edge that is pushed out of a closed surface. It does
// not always leave the surface through a face that one of its edges intersects.
bool Untangling::comes_out(const Contact& contact, const Vector& normal,
                           const Motion& motion) const {
  if (contact.body_a == contact.body_b) return false;
  const std::array<double, 4> weights = contact.weights();
  Vector pushed = Vector::Zero(), on_a = Vector::Zero(), on_b = Vector::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    (weights[i] > 0 ? on_a : on_b) += std::abs(weights[i]) * motion.start_of(v);
    const auto push = pushes_.find(v);
    if (push != pushes_.end()) pushed += weights[i] * push->second.displacement;
  }
  const auto contains = [this](std::int32_t body, const Vector& point) {
    return closed_surfaces_->is_closed(body) && closed_surfaces_->contains(body, point);
  };
  return pushed.dot(normal) < 0 &&
         (contains(contact.body_b, on_a) || contains(contact.body_a, on_b));
}

bool Untangling::penetrates(const Contact& contact, const Motion& motion) const {
  const int first_of_b = first_vertex_of_b(contact.kind);
  const std::int32_t* const v = contact.vertices.data();
  const bool soft_a = motion.is_soft(v[0]), soft_b = motion.is_soft(v[first_of_b]);
  if (soft_a == soft_b) return false;
  const auto count_a = static_cast<std::size_t>(first_of_b), count_b = 4 - count_a;
  return soft_a ? penetrations_.contains({v, count_a}, contact.body_b)
                : penetrations_.contains({v + first_of_b, count_b}, contact.body_a);
}

bool Untangling::allows_pass(const Contact& contact, const Motion& motion) const {
  if (!penetrations_.contacts.empty() && penetrates(contact, motion)) return true;
  if (directions_.empty()) return false;
  const Vector normal(contact.normal[0], contact.normal[1], contact.normal[2]);
  if (comes_out(contact, normal, motion)) return true;
  const int first_of_b = first_vertex_of_b(contact.kind);
  for (int i = 0; i < first_of_b; ++i) {
    for (int k = first_of_b; k < 4; ++k) {
      const auto direction = directions_.find({contact.vertices[i], contact.vertices[k]});
      if (direction != directions_.end() && direction->second.dot(normal) < 0) return true;
    }
  }
  return false;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
