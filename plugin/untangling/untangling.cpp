#include "untangling/untangling.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "untangling/closed_surfaces.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

constexpr double max_seconds_without_progress = 3;

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

void Untangling::start() {
  fewest_pairs_ = std::numeric_limits<std::size_t>::max();
  least_depth_ = std::numeric_limits<double>::infinity();
  seconds_without_progress_ = 0;
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
  seconds_without_progress_ += motion.dt;
  read(found, topology, edges, motion);
}

void Untangling::read(const Found& found, const Topology& topology, Span<const Edge> edges,
                      const Motion& motion) {
  skip_step();
  double depth = 0;
  for (const Contact& contact : found.penetrations.contacts) {
    const Vector normal(contact.normal[0], contact.normal[1], contact.normal[2]);
    const std::array<double, 4> weights = contact.weights();
    for (int i = 0; i < 4; ++i)
      depth -= weights[i] * normal.dot(motion.start_of(contact.vertices[i]));
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
  const std::size_t count = pairs.size() + found.penetrations.contacts.size();
  constexpr double progress = 0.99;
  if (count < fewest_pairs_ || depth < progress * least_depth_) seconds_without_progress_ = 0;
  least_depth_ = std::min(least_depth_, depth);
  fewest_pairs_ =
      seconds_without_progress_ < max_seconds_without_progress ? std::min(fewest_pairs_, count) : 0;
  if (!is_in_progress()) return;

  penetrations_ = found.penetrations;
  const auto add_pair = [this](std::int32_t a, std::int32_t b) {
    pairs_.push_back({std::min(a, b), std::max(a, b)});
  };
  for (const Contact& contact : penetrations_.contacts) add_pair(contact.body_a, contact.body_b);
  for (const Intersection& pair : pairs)
    add_pair(topology.body_of_vertex[edges[pair.edge][0]],
             topology.body_of_vertex[topology.faces[pair.face][0]]);
  std::sort(pairs_.begin(), pairs_.end());
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
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
  double compliance = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    shares[i] = motion.is_soft(vertices[i]) ? weights[i] * motion.inverse_mass[vertices[i]] : 0;
    compliance += weights[i] * shares[i];
  }
  if (!(compliance > 0)) return;
  const auto add_to = [](auto& sums, const auto& key, const Vector& summand) {
    sums.try_emplace(key, Vector::Zero()).first->second += summand;
  };
  for (std::size_t i = 0; i < 5; ++i) {
    if (shares[i] != 0) add_to(pushes_, vertices[i], shares[i] / compliance * direction);
  }
  for (const std::int32_t e : edge) {
    for (const std::int32_t f : face) {
      add_to(directions_, std::make_pair(e, f), direction);
      add_to(directions_, std::make_pair(f, e), -direction);
    }
  }
}

void Untangling::push(double distance, Motion& motion) const {
  double longest = 1;
  for (const auto& [vertex, displacement] : pushes_)
    longest = std::max(longest, displacement.norm());
  for (const auto& [vertex, displacement] : pushes_) {
    const Vector end = motion.end_of(vertex) + distance / longest * displacement;
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
    if (push != pushes_.end()) pushed += weights[i] * push->second;
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
