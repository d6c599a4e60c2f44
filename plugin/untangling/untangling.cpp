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

constexpr double patience = 3;  // s

// Into which the edges that stick in faces cut the surfaces.
class SurfaceComponents {
 public:
  SurfaceComponents(const std::vector<Intersection>& pairs, std::size_t vertices, Span<const Edge> edges)
      : components_(vertices), surfaces_(vertices) {
    std::vector<char> sticks(edges.size(), 0);
    for (const Intersection& pair : pairs) sticks[pair.edge] = 1;
    for (std::size_t e = 0; e < edges.size(); ++e) {
      surfaces_.join(edges[e][0], edges[e][1]);
      if (!sticks[e]) components_.join(edges[e][0], edges[e][1]);
    }
    std::map<std::int32_t, int> size;
    for (std::size_t v = 0; v < vertices; ++v) ++size[components_.find(static_cast<std::int32_t>(v))];
    for (const auto& [component, count] : size) {
      std::int32_t& largest = largest_.try_emplace(surfaces_.find(component), component).first->second;
      if (count > size[largest]) largest = component;
    }
  }
  // A vertex of the same.
  std::int32_t component_of(std::int32_t v) { return components_.find(v); }
  bool is_largest(std::int32_t component) { return largest_[surfaces_.find(component)] == component; }

 private:
  DisjointSets components_, surfaces_;
  std::map<std::int32_t, std::int32_t> largest_;  // component, by surface
};

// On which side of others' surfaces components belong.
class Sides {
 public:
  Sides(const std::vector<Intersection>& pairs, const Topology& topology, Span<const Edge> edges,
        const ClosedSurfaces& closed, const Motion& motion)
      : topology_(topology),
        motion_(motion),
        components_(pairs, motion.size(), edges),
        closed_(closed) {}

  // The vertex, of an edge that sticks in the face, is on the right side of that.
  bool is_right(std::int32_t v, const Face& face) {
    const std::int32_t component = components_.component_of(v), body = topology_.body_of_vertex[face[0]];
    if (topology_.body_of_vertex[v] == body || !closed_.is_closed(body))
      return components_.is_largest(component);
    const auto [at, is_new] = outside_.try_emplace({component, body}, true);
    if (is_new) at->second = !closed_.contains(body, motion_.start_of(v));
    return at->second;
  }

 private:
  const Topology& topology_;
  const Motion& motion_;
  SurfaceComponents components_;
  const ClosedSurfaces& closed_;
  std::map<std::pair<std::int32_t, std::int32_t>, bool> outside_;  // by component and body
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

// The sum of the directions in which the line in the plane of that normal goes on from the edge, in
// the faces that meet there.
Vector3d line_from(const Edge& edge, const std::vector<Face>& faces, const Vector3d& normal,
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
  fewest_ = std::numeric_limits<std::size_t>::max();
  waited_ = 0;
}

void Untangling::skip_step() {
  pushes_.clear();
  ways_.clear();
  closed_.reset();
}

void Untangling::begin_step(const Intersections& found, const Topology& topology,
                            Span<const Edge> edges, const Motion& motion) {
  waited_ += motion.dt;
  read(found, topology, edges, motion);
}

void Untangling::read(const Intersections& found, const Topology& topology, Span<const Edge> edges,
                      const Motion& motion) {
  skip_step();
  std::vector<Intersection> pairs;
  for (const Intersection& pair : found.pairs) {
    if (motion.is_soft(edges[pair.edge][0]) || motion.is_soft(topology.faces[pair.face][0]))
      pairs.push_back(pair);
  }
  if (pairs.size() < fewest_) waited_ = 0;
  fewest_ = waited_ < patience ? std::min(fewest_, pairs.size()) : 0;
  if (!goes_on()) return;

  closed_ = std::make_unique<ClosedSurfaces>(topology, motion);
  Sides sides(pairs, topology, edges, *closed_, motion);
  const FacesOfEdges faces = faces_of_edges(pairs, topology, edges);
  for (const Intersection& pair : pairs) {
    const Edge& edge = edges[pair.edge];
    const Face& face = topology.faces[pair.face];
    const Vector3d normal = normal_of(face, motion);
    const Vector3d along = (motion.start_of(edge[1]) - motion.start_of(edge[0])).normalized();
    const double across = along.dot(normal);
    const bool first_is_right = sides.is_right(edge[0], face);
    Vector3d way;
    if (first_is_right != sides.is_right(edge[1], face)) {
      way = (across > 0) == first_is_right ? -normal : normal;
    } else {
      const Vector3d line = line_from(edge, faces.at(sorted(edge[0], edge[1])), normal, motion);
      way = line - 2 * along.dot(line) / across * normal;
      way /= std::sqrt(1 + way.squaredNorm());
    }
    if (way.allFinite()) add(edge, face, way, motion);
  }
}

void Untangling::add(const Edge& edge, const Face& face, const Vector& way, const Motion& motion) {
  // Where the edge passes through the face.
  const Vector p = motion.start_of(edge[0]), along = motion.start_of(edge[1]) - p;
  const Vector a = motion.start_of(face[0]);
  const Vector ab = motion.start_of(face[1]) - a, ac = motion.start_of(face[2]) - a;
  const Vector area = ab.cross(ac);
  const double s = (a - p).dot(area) / along.dot(area);
  const Vector at = p + s * along - a;
  const double u = at.cross(ac).dot(area) / area.squaredNorm();
  const double v = ab.cross(at).dot(area) / area.squaredNorm();
  const std::array<std::int32_t, 5> vertices = {edge[0], edge[1], face[0], face[1], face[2]};
  const std::array<double, 5> weights = {1 - s, s, -(1 - u - v), -u, -v};
  std::array<double, 5> shares;
  double compliance = 0;
  for (std::size_t i = 0; i < 5; ++i) {
    shares[i] = motion.is_soft(vertices[i]) ? weights[i] * motion.inverse_mass[vertices[i]] : 0;
    compliance += weights[i] * shares[i];
  }
  if (!(compliance > 0)) return;
  const auto add_to = [](auto& sums, const auto& key, const Vector& more) {
    sums.try_emplace(key, Vector::Zero()).first->second += more;
  };
  for (std::size_t i = 0; i < 5; ++i) {
    if (shares[i] != 0) add_to(pushes_, vertices[i], shares[i] / compliance * way);
  }
  for (const std::int32_t e : edge) {
    for (const std::int32_t f : face) {
      add_to(ways_, std::make_pair(e, f), way);
      add_to(ways_, std::make_pair(f, e), -way);
    }
  }
}

void Untangling::push(double distance, Motion& motion) const {
  double longest = 1;
  for (const auto& [vertex, way] : pushes_) longest = std::max(longest, way.norm());
  for (const auto& [vertex, way] : pushes_) {
    const Vector end = motion.end_of(vertex) + distance / longest * way;
    for (int k = 0; k < 3; ++k)
      motion.end[3 * static_cast<std::size_t>(vertex) + k] = static_cast<btScalar>(end[k]);
  }
}

// What comes out of a closed surface does not always do so where its edges stick in that.
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
    return closed_->is_closed(body) && closed_->contains(body, point);
  };
  return pushed.dot(normal) < 0 &&
         (contains(contact.body_b, on_a) || contains(contact.body_a, on_b));
}

bool Untangling::lets_pass(const Contact& contact, const Motion& motion) const {
  if (ways_.empty()) return false;
  const Vector normal(contact.normal[0], contact.normal[1], contact.normal[2]);
  if (comes_out(contact, normal, motion)) return true;
  const int first_of_b = contact.kind == ContactKind::vertex_face ? 1 : 2;
  for (int i = 0; i < first_of_b; ++i) {
    for (int k = first_of_b; k < 4; ++k) {
      const auto way = ways_.find({contact.vertices[i], contact.vertices[k]});
      if (way != ways_.end() && way->second.dot(normal) < 0) return true;
    }
  }
  return false;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
