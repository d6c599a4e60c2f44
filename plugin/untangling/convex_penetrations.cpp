#include "untangling/convex_penetrations.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "settings.h"
#include "untangling/intersections.h"
#include "util/box.h"
#include "util/disjoint_sets.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// A point that is inside.
struct Point {
  std::vector<std::int32_t> of;  // vertices of the primitive: one, an edge or a face
  double u, v;                   // place on it, as in Contact
  Vector3d x;
  std::int32_t face = -1;  // the primitive, if it is a face
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

using Group = std::vector<Point>;

double depth_below(const Side& side, const Group& group) {
  double depth = 0;
  for (const Point& point : group) depth = std::max(depth, -side.height(point.x));
  return depth;
}

// Of a point inside, to the nearest side.
double depth_of(const Vector3d& x, const std::vector<Side>& sides) {
  double depth = std::numeric_limits<double>::infinity();
  for (const Side& side : sides) depth = std::min(depth, -side.height(x));
  return depth;
}

// True if a blocking face is on the way of a point to the side, or within the margins of it.
bool is_blocked(const Side& side, const Group& group, const Blocking& blocking,
                const Topology& topology, const Motion& motion) {
  const Vector3d margin = blocking.margin * side.normal;
  std::vector<std::array<Vector3d, 2>> ways;
  Box3d box;
  for (const Point& point : group) {
    ways.push_back({point.x - margin, point.x - side.height(point.x) * side.normal + margin});
    for (const Vector3d& end : ways.back()) box.extend(end);
  }
  return std::any_of(blocking.faces.begin(), blocking.faces.end(), [&](std::int32_t f) {
    const Face& face = topology.faces[f];
    const Vector3d a = motion.start_of(face[0]), b = motion.start_of(face[1]),
                   c = motion.start_of(face[2]);
    Box3d of_face(a);
    of_face.extend(b).extend(c);
    return box.intersects(of_face) && std::any_of(ways.begin(), ways.end(), [&](const auto& way) {
             return edge_intersects_face(way[0], way[1], a, b, c);
           });
  });
}

// True if the group reaches from the side to one that faces away from it by `min_cosine`. To leave
// through the side, what passes through both would have to let go of the whole body. If
// `continues`, only what goes on behind the other side counts.
bool reaches_through(const Side& side, double depth, const Group& group,
                     const std::vector<Side>& sides, double min_cosine, bool continues,
                     const Motion& motion) {
  return std::any_of(group.begin(), group.end(), [&](const Point& point) {
    const double rounding = 4 * rounding_at(point.x);
    const auto is_deeper = [&](std::int32_t v) {
      return -side.height(motion.start_of(v)) > depth + rounding;
    };
    return -side.height(point.x) > depth - rounding &&
           (!continues || std::any_of(point.of.begin(), point.of.end(), is_deeper)) &&
           std::any_of(sides.begin(), sides.end(), [&](const Side& other) {
             return other.normal.dot(side.normal) < -min_cosine &&
                    other.height(point.x) > -rounding;
           });
  });
}

// The nearest side through which the group can leave; null if there is none. What is pierced must
// not be stretched: it does not leave through a side if it reaches through the body from there. If
// the nearest side is blocked, the way to another is no longer than the group is wide, and nothing
// is dragged along the body: a rug below a lying capsule does not leave through its ends.
const Side* find_exit(const Group& group, const std::vector<Side>& sides, const Blocking& blocking,
                      const Topology& topology, const Motion& motion) {
  Box3d box;
  for (const Point& point : group) box.extend(point.x);
  const bool is_pierced = std::any_of(group.begin(), group.end(),
                                      [](const Point& point) { return point.of.size() > 1; });
  std::vector<std::pair<double, const Side*>> by_depth;
  for (const Side& side : sides) by_depth.emplace_back(depth_below(side, group), &side);
  std::stable_sort(by_depth.begin(), by_depth.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto would_stretch = [&](double depth, const Side& side) {
    if (!is_pierced) return false;
    if (reaches_through(side, depth, group, sides, settings::untangling::faces_away, false, motion))
      return true;
    return &side != by_depth[0].second &&
           (depth > box.diagonal().norm() ||
            reaches_through(side, depth, group, sides, settings::untangling::faces_backward, true,
                            motion));
  };
  for (const auto& [depth, side] : by_depth) {
    if (!blocking.is_movable && would_stretch(depth, *side)) continue;
    if (!is_blocked(*side, group, blocking, topology, motion)) return side;
  }
  return nullptr;
}

// An edge or a face with a vertex that is inside counts as this vertex. `inside` is sorted.
void add_trapped(const Group& group, const std::vector<std::int32_t>& inside,
                 PenetrationList& found) {
  const std::vector<std::int32_t>* last = nullptr;
  for (const Point& point : group) {
    if (last && *last == point.of) continue;  // another point of the same primitive
    last = &point.of;
    if (point.of.size() == 1) {
      found.add_trapped(point.of[0]);
    } else if (std::none_of(point.of.begin(), point.of.end(), [&](std::int32_t v) {
                 return std::binary_search(inside.begin(), inside.end(), v);
               })) {
      if (point.of.size() == 2)
        found.add_trapped(Edge{point.of[0], point.of[1]});
      else
        found.add_trapped(Face{point.of[0], point.of[1], point.of[2]});
    }
  }
}

}  // namespace

void find_in_convex(const StepTopology& topology, const Motion& motion,
                    const Candidates& candidates, const Vector3d& origin,
                    const std::vector<Side>& sides, PenetrationList& found) {
  std::vector<std::int32_t> inside;
  for (const std::int32_t v : candidates.vertices) {
    const Vector3d x = motion.start_of(v);
    if (std::all_of(sides.begin(), sides.end(),
                    [&](const Side& side) { return is_below(side, x, origin); }))
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
  const Topology view = topology.topology();
  for (const std::int32_t f : candidates.pierced) {
    const Face& face = view.faces[f];
    for (const auto& [u, v] : clip(face, sides, motion))
      points.push_back({{face[0], face[1], face[2]}, u, v, point_of(face, u, v, motion), f});
    found.add_passing(face);
  }
  Clusters clusters = find_clusters(topology, points, inside);
  std::map<std::int32_t, Group> groups;
  for (const Point& point : points) groups[clusters.cluster_of(point.of[0])].push_back(point);
  for (const auto& [key, group] : groups) {
    const Side* const best = find_exit(group, sides, candidates.blocking, view, motion);
    for (const Point& point : group)
      if (point.of.size() == 1) found.add_inside(point.of[0], depth_of(point.x, sides));
    if (!best) {
      if (!candidates.blocking.is_movable) add_trapped(group, inside, found);
      continue;
    }
    for (const Point& point : group) {
      if (point.of.size() == 1) {
        found.add(point.of[0], *best);
      } else if (point.of.size() == 2) {
        found.add(Edge{point.of[0], point.of[1]}, point.u, *best);
      } else {
        found.add(point.face, point.u, point.v, *best);
      }
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
