#include "untangling/convex_penetrations.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// A point that is inside.
struct Point {
  std::vector<std::int32_t> of;  // vertices of the primitive: one, an edge or a face
  double u, v;                   // place on it, as in Contact
  Vector3d x;
};

// The part of an edge inside of a convex body, as two parameters; none if it is not inside.
std::optional<std::array<double, 2>> clip(const Edge& edge, const std::vector<Side>& sides,
                                          const Motion& motion) {
  const Vector3d a = motion.start_of(edge[0]), b = motion.start_of(edge[1]);
  double first = 0, last = 1;
  for (const Side& side : sides) {
    const double from = side.height(a), to = side.height(b);
    if (from >= 0 && to >= 0) return std::nullopt;
    if (from < 0 && to < 0) continue;
    const double at = from / (from - to);
    (from < 0 ? last : first) = from < 0 ? std::min(last, at) : std::max(first, at);
  }
  if (!(first < last)) return std::nullopt;
  return std::array<double, 2>{first, last};
}

Vector3d point_of(const Face& face, double u, double v, const Motion& motion) {
  return (1 - u - v) * motion.start_of(face[0]) + u * motion.start_of(face[1]) +
         v * motion.start_of(face[2]);
}

// Corners of the part of a face inside of a convex body, as coordinates u and v.
std::vector<std::pair<double, double>> clip(const Face& face, const std::vector<Side>& sides,
                                            const Motion& motion) {
  std::vector<std::pair<double, double>> corners = {{0, 0}, {1, 0}, {0, 1}}, kept;
  for (const Side& side : sides) {
    const auto height = [&](const std::pair<double, double>& p) {
      return side.height(point_of(face, p.first, p.second, motion));
    };
    kept.clear();
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto &a = corners[i], &b = corners[(i + 1) % corners.size()];
      const double from = height(a), to = height(b);
      if (from <= 0) kept.push_back(a);
      if ((from < 0 && to > 0) || (from > 0 && to < 0)) {
        const double at = from / (from - to);
        kept.emplace_back(a.first + at * (b.first - a.first),
                          a.second + at * (b.second - a.second));
      }
    }
    corners.swap(kept);
  }
  return corners;
}

// Which vertices hang together.
class Clusters {
 public:
  // `vertices`: sorted.
  explicit Clusters(std::vector<std::int32_t> vertices)
      : vertices_(std::move(vertices)), sets_(vertices_.size()) {}

  // Joins what an edge or face of the body connects.
  template <class Primitive>
  void join(const Primitive& primitive) {
    for (const std::int32_t v : primitive) sets_.join(index_of(primitive[0]), index_of(v));
  }
  // The same for those of its vertices that are in `inside`, which is sorted.
  template <class Primitive>
  void join_inside(const Primitive& primitive, const std::vector<std::int32_t>& inside) {
    std::int32_t last = -1;
    for (const std::int32_t v : primitive) {
      if (!std::binary_search(inside.begin(), inside.end(), v)) continue;
      if (last >= 0) sets_.join(index_of(last), index_of(v));
      last = v;
    }
  }
  std::int32_t cluster_of(std::int32_t vertex) { return sets_.find(index_of(vertex)); }

 private:
  std::int32_t index_of(std::int32_t vertex) const {
    const auto at = std::lower_bound(vertices_.begin(), vertices_.end(), vertex);
    return static_cast<std::int32_t>(at - vertices_.begin());
  }

  std::vector<std::int32_t> vertices_;
  DisjointSets sets_;
};

// Clusters of the points: those of one primitive, and vertices inside that an edge connects.
Clusters find_clusters(const StepTopology& topology, const std::vector<Point>& points,
                       const std::vector<std::int32_t>& inside) {
  std::vector<std::int32_t> vertices;
  for (const Point& point : points)
    vertices.insert(vertices.end(), point.of.begin(), point.of.end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  Clusters clusters(std::move(vertices));
  const Topology view = topology.topology();
  std::set<std::int32_t> bodies;
  for (const std::int32_t v : inside) bodies.insert(topology.body_of(v));
  for (const std::int32_t body : bodies) {
    const StepTopology::BodyRecord& record = topology.bodies()[body];
    for (std::int32_t f = record.faces.first; f < record.faces.last; ++f)
      clusters.join_inside(view.faces[f], inside);
    for (std::int32_t e = record.edges.first; e < record.edges.last; ++e)
      clusters.join_inside(view.edges[e], inside);
  }
  for (const Point& point : points) clusters.join(point.of);
  return clusters;
}

}  // namespace

void find_in_convex(const StepTopology& topology, const Motion& motion,
                    const Candidates& candidates, const std::vector<Side>& sides,
                    PenetrationList& found) {
  std::vector<std::int32_t> inside;
  for (const std::int32_t v : candidates.vertices) {
    const Vector3d x = motion.start_of(v);
    if (std::all_of(sides.begin(), sides.end(),
                    [&](const Side& side) { return side.height(x) < -rounding_at(x); }))
      inside.push_back(v);
  }
  std::sort(inside.begin(), inside.end());
  std::vector<Point> points;
  for (const std::int32_t v : inside) points.push_back({{v}, 0, 0, motion.start_of(v)});
  for (const Edge& edge : candidates.edges) {
    const auto part = clip(edge, sides, motion);
    if (!part) continue;
    const Vector3d a = motion.start_of(edge[0]), b = motion.start_of(edge[1]);
    for (const double at : *part) {
      if (at > 0 && at < 1) points.push_back({{edge[0], edge[1]}, at, 0, a + at * (b - a)});
    }
    found.add_passing(edge);
  }
  for (const Face& face : candidates.pierced) {
    for (const auto& [u, v] : clip(face, sides, motion))
      points.push_back({{face[0], face[1], face[2]}, u, v, point_of(face, u, v, motion)});
    found.add_passing(face);
  }
  Clusters clusters = find_clusters(topology, points, inside);
  std::map<std::int32_t, std::vector<Point>> groups;
  for (const Point& point : points) groups[clusters.cluster_of(point.of[0])].push_back(point);
  for (const auto& [key, group] : groups) {
    const Side* best = nullptr;
    double shortest = std::numeric_limits<double>::infinity();
    for (const Side& side : sides) {
      double depth = 0;
      for (const Point& point : group) depth = std::max(depth, -side.height(point.x));
      if (depth >= shortest) continue;
      shortest = depth;
      best = &side;
    }
    for (const Point& point : group) {
      if (point.of.size() == 1) {
        found.add(point.of[0], *best);
      } else if (point.of.size() == 2) {
        found.add(Edge{point.of[0], point.of[1]}, point.u, *best);
      } else {
        found.add(Face{point.of[0], point.of[1], point.of[2]}, point.u, point.v, *best);
      }
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
