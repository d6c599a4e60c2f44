#include "untangling/intersections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "lazyccd/query.h"
#include "touching/bodies_that_meet.h"
#include "touching/strips.h"
#include "untangling/pair_rules.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Side of the plane abc on which the point p lies; 0 if rounding could decide the sign.
int side(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d u = a - p, v = b - p, w = c - p;
  const Vector3d au = u.cwiseAbs(), av = v.cwiseAbs(), aw = w.cwiseAbs();
  const double scale = au.maxCoeff() * av.maxCoeff() * aw.maxCoeff();
  const double volume = u.cross(v).dot(w);
  return std::abs(volume) > 1e-13 * scale ? (volume > 0 ? 1 : -1) : 0;
}

}  // namespace

// First, side() must be certain that the ends are on different sides of the plane. The rest is
// exact: does a point that moves from p to q meet the face?
bool edge_intersects_face(const Vector3d& p, const Vector3d& q, const Vector3d& a,
                          const Vector3d& b, const Vector3d& c) {
  if (side(p, a, b, c) * side(q, a, b, c) >= 0) return false;
  const auto point = [](const Vector3d& x) { return std::array<double, 3>{x[0], x[1], x[2]}; };
  return decide(ContactKind::vertex_face,
                {point(p), point(a), point(b), point(c), point(q), point(a), point(b), point(c)})
      .hit;
}

Intersections find_intersections(const Topology& topology, Span<const Edge> edges,
                                 const Positions& positions,
                                 const std::function<bool(std::int32_t)>& responds,
                                 const std::function<bool(const Edge&, const Face&)>& is_ignored,
                                 const std::vector<std::int32_t>* of_bodies) {
  std::vector<Vector3d> x;
  for (std::size_t i = 0; i < positions.count(); ++i) {
    const std::array<double, 3> p = positions[i];
    x.emplace_back(p[0], p[1], p[2]);
  }
  const PairRules pair_rules(topology, responds);
  const std::vector<char> is_asked_for = bodies_asked_for(topology, of_bodies);
  const auto movable = [&](std::int32_t v) { return topology.inverse_mass[v] > 0; };
  Intersections found;
  const auto test = [&](const Strips::Box& edge_box, const Strips::Box& face_box) {
    if (!is_below(edge_box.lower, face_box.upper) || !is_below(face_box.lower, edge_box.upper))
      return;
    const Edge& e = edges[edge_box.primitive];
    const Face& f = topology.faces[face_box.primitive];
    for (const std::int32_t v : f) {
      if (v == e[0] || v == e[1]) return;
    }
    const std::int32_t a = topology.body_of_vertex[e[0]], b = topology.body_of_vertex[f[0]];
    if (!is_asked_for[a] && !is_asked_for[b]) return;
    const bool moves =
        std::any_of(e.begin(), e.end(), movable) || std::any_of(f.begin(), f.end(), movable);
    if (!moves || !pair_rules.collide(a, b) ||
        !edge_intersects_face(x[e[0]], x[e[1]], x[f[0]], x[f[1]], x[f[2]]) || is_ignored(e, f))
      return;
    if (found.pairs.empty()) found.first = {a, b};
    found.pairs.push_back({edge_box.primitive, face_box.primitive});
  };
  const auto no_reach = [](std::int32_t) { return 0.0; };
  const std::vector<char> body_may_collide = find_bodies_that_meet(
      topology, x, no_reach,
      [&](std::int32_t a, std::int32_t b) { return pair_rules.collide(a, b); }, is_asked_for);
  const auto may_collide = [&](std::int32_t v) {
    return body_may_collide[topology.body_of_vertex[v]] != 0;
  };
  const Strips strips(x, edges.size());
  strips.sweep(strips.boxes_of(edges, x, may_collide, no_reach),
               strips.boxes_of(topology.faces, x, may_collide, no_reach), test);
  return found;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
