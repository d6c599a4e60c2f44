#include "untangling/penetrations.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "motion/rotation.h"
#include "untangling/closed_surfaces.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Vertices = std::vector<std::int32_t>;

// A face that points out of the body.
struct Side {
  std::int32_t face;
  Vector3d normal;
  double offset;  // normal . x of its plane, metres

  double height(const Vector3d& x) const { return normal.dot(x) - offset; }
};

Edge sorted(const Edge& edge) { return {std::min(edge[0], edge[1]), std::max(edge[0], edge[1])}; }

// What may penetrate one part of an obstacle.
struct Candidates {
  Vertices vertices;          // soft vertices that collide with the obstacle and can be moved out
  std::vector<Edge> edges;    // soft edges that pass through faces of the part; sorted vertices
  std::vector<Face> pierced;  // soft faces through which edges of the part pass
};

// Finds the penetrations of one obstacle.
class Finder {
 public:
  Finder(const Topology& topology, Span<const Edge> edges, const Motion& motion,
         std::int32_t obstacle, Penetrations& found)
      : topology_(topology), edges_(edges), motion_(motion), obstacle_(obstacle), found_(found) {}

  // Below a terrain, along its up axis.
  void find_below(const Candidates& candidates, const Vertices& faces, const Vector3d& up) {
    for (const std::int32_t v : candidates.vertices) {
      const Vector3d x = motion_.start_of(v);
      for (const std::int32_t f : faces) {
        if (is_degenerate(f)) continue;
        const Side side = side_of(f, up);
        if (!(side.height(x) < -tolerance(x)) || !covers(f, up, x)) continue;
        add(v, side);
        break;
      }
    }
  }

  void find_below_plane(const Candidates& candidates, std::int32_t face, const Vector3d& up) {
    find_inside_convex(candidates, {side_of(face, up)});
  }

  // Inside of a part of the obstacle that shares no vertex with other parts.
  void find_inside(const Candidates& all, const Vertices& faces) {
    if (!is_closed_mesh(topology_, faces)) return;
    AlignedBox3d box;
    Vector3d middle = Vector3d::Zero();
    for (const std::int32_t f : faces) {
      for (const std::int32_t corner : topology_.faces[f]) {
        box.extend(motion_.start_of(corner));
        middle += motion_.start_of(corner) / (3.0 * static_cast<double>(faces.size()));
      }
    }
    Candidates near = all;
    near.vertices.clear();
    for (const std::int32_t v : all.vertices) {
      if (box.contains(motion_.start_of(v))) near.vertices.push_back(v);
    }
    if (near.vertices.empty() && near.edges.empty() && near.pierced.empty()) return;
    std::vector<Side> sides;
    for (const std::int32_t f : faces) {
      if (is_degenerate(f)) continue;
      sides.push_back(side_of(f, Vector3d::Zero()));
      // The faces may be oriented inwards.
      if (sides.back().height(middle) <= 0) continue;
      sides.back().normal = -sides.back().normal;
      sides.back().offset = -sides.back().offset;
    }
    if (is_convex(faces, sides, 1e-4 * box.diagonal().norm())) {
      find_inside_convex(near, sides);
    } else {
      find_inside_closed(near.vertices, faces);
    }
  }

 private:
  // Rounding of positions, metres.
  static double tolerance(const Vector3d& x) {
    return 16 * static_cast<double>(SIMD_EPSILON) * std::max(1.0, x.cwiseAbs().maxCoeff());
  }

  // True if the face is a line but for the rounding of positions, so that it has no normal.
  bool is_degenerate(std::int32_t face) const {
    const Face& f = topology_.faces[face];
    const Vector3d a = motion_.start_of(f[0]), ab = motion_.start_of(f[1]) - a,
                   ac = motion_.start_of(f[2]) - a;
    const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
    return !(ab.cross(ac).norm() > tolerance(a) * longest);
  }

  // `up` orients the normal if it is not zero.
  Side side_of(std::int32_t face, const Vector3d& up) const {
    const Face& f = topology_.faces[face];
    const Vector3d a = motion_.start_of(f[0]);
    Vector3d normal = (motion_.start_of(f[1]) - a).cross(motion_.start_of(f[2]) - a).normalized();
    if (normal.dot(up) < 0) normal = -normal;
    return {face, normal, normal.dot(a)};
  }

  bool is_convex(const Vertices& faces, const std::vector<Side>& sides, double spare) const {
    return std::all_of(sides.begin(), sides.end(), [&](const Side& side) {
      return std::all_of(faces.begin(), faces.end(), [&](std::int32_t f) {
        const Face& face = topology_.faces[f];
        return std::all_of(face.begin(), face.end(), [&](std::int32_t v) {
          return side.height(motion_.start_of(v)) <= spare;
        });
      });
    });
  }

  // True if the line through x along `axis` passes through the face.
  bool covers(std::int32_t face, const Vector3d& axis, const Vector3d& x) const {
    const Face& f = topology_.faces[face];
    const Vector3d a = motion_.start_of(f[0]) - x, b = motion_.start_of(f[1]) - x,
                   c = motion_.start_of(f[2]) - x;
    const double u = axis.dot(a.cross(b)), v = axis.dot(b.cross(c)), w = axis.dot(c.cross(a));
    return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
  }

  // The part of an edge inside of a convex body, as two parameters; none if it is not inside.
  std::optional<std::array<double, 2>> clip(const Edge& edge,
                                            const std::vector<Side>& sides) const {
    const Vector3d a = motion_.start_of(edge[0]), b = motion_.start_of(edge[1]);
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

  Vector3d point_of(const Face& face, double u, double v) const {
    return (1 - u - v) * motion_.start_of(face[0]) + u * motion_.start_of(face[1]) +
           v * motion_.start_of(face[2]);
  }

  // Corners of the part of a face inside of a convex body, as coordinates u and v.
  std::vector<std::pair<double, double>> clip(const Face& face,
                                              const std::vector<Side>& sides) const {
    std::vector<std::pair<double, double>> corners = {{0, 0}, {1, 0}, {0, 1}}, kept;
    for (const Side& side : sides) {
      const auto height = [&](const std::pair<double, double>& p) {
        return side.height(point_of(face, p.first, p.second));
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

  void find_inside_convex(const Candidates& candidates, const std::vector<Side>& sides) {
    struct Point {
      std::vector<std::int32_t> of;  // vertices of the primitive: one, an edge or a face
      double u, v;                   // place on it, as in Contact
      Vector3d x;
    };
    Vertices inside;
    for (const std::int32_t v : candidates.vertices) {
      const Vector3d x = motion_.start_of(v);
      if (std::all_of(sides.begin(), sides.end(),
                      [&](const Side& side) { return side.height(x) < -tolerance(x); }))
        inside.push_back(v);
    }
    std::sort(inside.begin(), inside.end());
    const auto is_inside = [&](std::int32_t v) {
      return std::binary_search(inside.begin(), inside.end(), v);
    };
    std::vector<Point> points;
    for (const std::int32_t v : inside) points.push_back({{v}, 0, 0, motion_.start_of(v)});
    for (const Edge& edge : candidates.edges) {
      const auto part = clip(edge, sides);
      if (!part) continue;
      const Vector3d a = motion_.start_of(edge[0]), b = motion_.start_of(edge[1]);
      for (const double at : *part) {
        if (at > 0 && at < 1) points.push_back({{edge[0], edge[1]}, at, 0, a + at * (b - a)});
      }
      found_.edges.push_back({edge[0], edge[1], obstacle_});
    }
    for (Face face : candidates.pierced) {
      for (const auto& [u, v] : clip(face, sides))
        points.push_back({{face[0], face[1], face[2]}, u, v, point_of(face, u, v)});
      std::sort(face.begin(), face.end());
      found_.faces.push_back({face[0], face[1], face[2], obstacle_});
    }
    // Groups of points that hang together.
    DisjointSets sets(topology_.vertex_count);
    for (const Edge& edge : edges_) {
      if (is_inside(edge[0]) && is_inside(edge[1])) sets.join(edge[0], edge[1]);
    }
    for (const Point& point : points) {
      for (const std::int32_t v : point.of) sets.join(point.of[0], v);
    }
    std::map<std::int32_t, std::vector<Point>> groups;
    for (const Point& point : points) groups[sets.find(point.of[0])].push_back(point);
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
          add(point.of[0], *best);
        } else if (point.of.size() == 2) {
          add(Edge{point.of[0], point.of[1]}, point.u, *best);
        } else {
          add(Face{point.of[0], point.of[1], point.of[2]}, point.u, point.v, *best);
        }
      }
    }
  }

  void find_inside_closed(const Vertices& near, const Vertices& faces) {
    for (const std::int32_t v : near) {
      const Vector3d x = motion_.start_of(v);
      if (std::abs(winding_number(topology_, motion_, faces, x)) < 0.5) continue;
      Side nearest{-1, Vector3d::Zero(), 0};
      double shortest = std::numeric_limits<double>::infinity();
      for (const std::int32_t f : faces) {
        if (is_degenerate(f)) continue;
        const Vector3d to = closest_point(f, x) - x;
        if (!(to.norm() < shortest) || to.norm() <= tolerance(x)) continue;
        shortest = to.norm();
        nearest = {f, to.normalized(), to.normalized().dot(x + to)};
      }
      if (nearest.face >= 0) add(v, nearest);
    }
  }

  // Closest point of a triangle; Ericson 2005, "Real-Time Collision Detection", section 5.1.5.
  Vector3d closest_point(std::int32_t face, const Vector3d& p) const {
    const Face& f = topology_.faces[face];
    const Vector3d a = motion_.start_of(f[0]), b = motion_.start_of(f[1]),
                   c = motion_.start_of(f[2]);
    const Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) return a;
    const double d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) return b;
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) return c;
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) return b + (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b);
    return a + vb / (va + vb + vc) * ab + vc / (va + vb + vc) * ac;
  }

  Contact contact_with(const Side& side, std::int32_t soft_vertex, ContactKind kind) const {
    Contact contact = {};
    contact.kind = kind;
    contact.body_a = topology_.body_of_vertex[soft_vertex];
    contact.body_b = obstacle_;
    contact.primitive_b = side.face;
    for (int k = 0; k < 3; ++k) contact.normal[k] = static_cast<float>(side.normal[k]);
    return contact;
  }

  void add(std::int32_t v, const Side& side) {
    const Face& f = topology_.faces[side.face];
    Contact contact = contact_with(side, v, ContactKind::vertex_face);
    contact.primitive_a = v;
    contact.vertices = {v, f[0], f[1], f[2]};
    // Barycentric coordinates of the vertex, projected onto the face's plane.
    const Vector3d a = motion_.start_of(f[0]), ab = motion_.start_of(f[1]) - a,
                   ac = motion_.start_of(f[2]) - a, area = ab.cross(ac);
    const Vector3d point = motion_.start_of(v) - a;
    contact.u = static_cast<float>(point.cross(ac).dot(area) / area.squaredNorm());
    contact.v = static_cast<float>(ab.cross(point).dot(area) / area.squaredNorm());
    found_.contacts.push_back(contact);
    found_.vertices.push_back({v, obstacle_});
  }

  // The point at `at` along an edge. Of the face only one side is used: its plane counts.
  void add(const Edge& edge, double at, const Side& side) {
    const Face& f = topology_.faces[side.face];
    Contact contact = contact_with(side, edge[0], ContactKind::edge_edge);
    contact.primitive_a = edge[0];
    contact.vertices = {edge[0], edge[1], f[0], f[1]};
    const Vector3d a = motion_.start_of(edge[0]),
                   along = motion_.start_of(f[1]) - motion_.start_of(f[0]);
    const Vector3d point = a + at * (motion_.start_of(edge[1]) - a) - motion_.start_of(f[0]);
    contact.u = static_cast<float>(at);
    contact.v = static_cast<float>(point.dot(along) / along.squaredNorm());
    found_.contacts.push_back(contact);
  }

  // A point of a soft face. Here the obstacle's side is the vertex.
  void add(const Face& face, double u, double v, const Side& side) {
    Contact contact = contact_with(side, face[0], ContactKind::vertex_face);
    std::swap(contact.body_a, contact.body_b);
    contact.primitive_a = topology_.faces[side.face][0];
    contact.primitive_b = face[0];
    contact.vertices = {topology_.faces[side.face][0], face[0], face[1], face[2]};
    for (float& x : contact.normal) x = -x;
    contact.u = static_cast<float>(u);
    contact.v = static_cast<float>(v);
    found_.contacts.push_back(contact);
  }

  const Topology& topology_;
  Span<const Edge> edges_;
  const Motion& motion_;
  std::int32_t obstacle_;
  Penetrations& found_;
};

// The faces of a body, divided into parts that share no vertex; by the smallest vertex found there.
std::map<std::int32_t, Vertices> parts_of(const Topology& topology, const Vertices& faces,
                                          DisjointSets& sets) {
  for (const std::int32_t f : faces) {
    for (const std::int32_t corner : topology.faces[f]) sets.join(topology.faces[f][0], corner);
  }
  std::map<std::int32_t, Vertices> parts;
  for (const std::int32_t f : faces) parts[sets.find(topology.faces[f][0])].push_back(f);
  return parts;
}

// Keeps one of several contacts that compare equal, and sorts.
void finish(Penetrations& found) {
  std::stable_sort(found.contacts.begin(), found.contacts.end());
  for (auto* const list : {&found.vertices}) std::sort(list->begin(), list->end());
  std::sort(found.edges.begin(), found.edges.end());
  std::sort(found.faces.begin(), found.faces.end());
}

}  // namespace

bool Penetrations::contains(Span<const std::int32_t> soft, std::int32_t body) const {
  const auto has_vertex = [&](std::int32_t v) {
    return std::binary_search(vertices.begin(), vertices.end(),
                              std::array<std::int32_t, 2>{v, body});
  };
  if (std::any_of(soft.begin(), soft.end(), has_vertex)) return true;
  for (std::size_t i = 0; i < soft.size(); ++i) {
    for (std::size_t k = i + 1; k < soft.size(); ++k) {
      const Edge edge = sorted({soft[i], soft[k]});
      if (std::binary_search(edges.begin(), edges.end(),
                             std::array<std::int32_t, 3>{edge[0], edge[1], body}))
        return true;
    }
  }
  if (soft.size() != 3) return false;
  Face face = {soft[0], soft[1], soft[2]};
  std::sort(face.begin(), face.end());
  return std::binary_search(faces.begin(), faces.end(),
                            std::array<std::int32_t, 4>{face[0], face[1], face[2], body});
}

Penetrations find_penetrations(const StepTopology& topology, const Intersections& intersections,
                               Span<const Edge> edges, const Motion& motion,
                               const PairRules& pair_rules,
                               const std::function<bool(std::int32_t, std::int32_t)>& is_anchored) {
  const Topology view = topology.topology();
  Penetrations found;
  std::vector<Vertices> faces(view.bodies.size());
  for (std::size_t f = 0; f < view.faces.size(); ++f) {
    const std::int32_t body = view.body_of_vertex[view.faces[f][0]];
    if (!topology.bodies()[body].soft) faces[body].push_back(static_cast<std::int32_t>(f));
  }
  std::vector<AlignedBox3d> boxes(view.bodies.size());
  for (std::size_t v = 0; v < view.vertex_count; ++v)
    boxes[view.body_of_vertex[v]].extend(motion.start_of(static_cast<std::int32_t>(v)));
  for (std::int32_t obstacle = 0; obstacle < static_cast<std::int32_t>(faces.size()); ++obstacle) {
    if (faces[obstacle].empty()) continue;
    const int shape_type = topology.bodies()[obstacle].object->getCollisionShape()->getShapeType();
    const bool has_bottom =
        shape_type != STATIC_PLANE_PROXYTYPE && shape_type != TERRAIN_SHAPE_PROXYTYPE;
    Candidates all;
    const bool obstacle_moves = motion.rigid_of(obstacle).is_movable();
    for (std::int32_t body = 0; body < static_cast<std::int32_t>(view.bodies.size()); ++body) {
      const StepTopology::BodyRecord& record = topology.bodies()[body];
      if (!record.soft || (has_bottom && !boxes[body].intersects(boxes[obstacle])) ||
          !pair_rules.collide(body, obstacle))
        continue;
      const std::int32_t last = record.first_vertex + record.vertex_count;
      for (std::int32_t v = record.first_vertex; v < last; ++v) {
        if ((obstacle_moves || motion.is_movable(v)) && !is_anchored(v, obstacle))
          all.vertices.push_back(v);
      }
    }
    if (all.vertices.empty()) continue;
    Finder finder(view, edges, motion, obstacle, found);
    DisjointSets sets(view.vertex_count);
    const auto parts = parts_of(view, faces[obstacle], sets);
    std::map<std::int32_t, Candidates> candidates;  // by part
    for (const auto& part : parts) candidates[part.first].vertices = all.vertices;
    for (const Intersection& pair : intersections.pairs) {
      const Edge& edge = edges[pair.edge];
      const Face& face = view.faces[pair.face];
      if (view.body_of_vertex[face[0]] == obstacle)
        candidates[sets.find(face[0])].edges.push_back(sorted(edge));
      if (view.body_of_vertex[edge[0]] == obstacle)
        candidates[sets.find(edge[0])].pierced.push_back(face);
    }
    for (auto& entry : candidates) {
      std::vector<Edge>& list = entry.second.edges;
      std::sort(list.begin(), list.end());
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    const btCollisionShape& shape = *topology.bodies()[obstacle].object->getCollisionShape();
    const Eigen::Matrix3d basis = to_eigen(motion.rigid_of(obstacle).start.getBasis());
    for (const auto& [part, part_faces] : parts) {
      const Candidates& of_part = candidates[part];
      if (shape_type == STATIC_PLANE_PROXYTYPE) {
        const auto& plane = static_cast<const btStaticPlaneShape&>(shape);
        finder.find_below_plane(of_part, part_faces.front(),
                                basis * to_eigen(plane.getPlaneNormal()));
      } else if (shape_type == TERRAIN_SHAPE_PROXYTYPE) {
        const int axis = static_cast<const btHeightfieldTerrainShape&>(shape).getUpAxis();
        finder.find_below(of_part, part_faces, basis.col(axis));
      } else {
        finder.find_inside(of_part, part_faces);
      }
    }
  }
  finish(found);
  return found;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
