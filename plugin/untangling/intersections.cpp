#include "untangling/intersections.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "lazyccd/query.h"
#include "untangling/pair_rules.h"
#include "util/box.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Sweep and prune along the axis with the largest spread, in strips across the axis with the second
// largest. Without strips, at each place along the axis all boxes across the width of a cloth would
// overlap.
class Strips {
 public:
  Strips(const std::vector<Vector3d>& x, std::size_t boxes) {
    if (x.empty()) return;
    const double count = static_cast<double>(x.size());
    Vector3d mean = Vector3d::Zero(), square = Vector3d::Zero();
    for (const Vector3d& p : x) mean += p / count;
    for (const Vector3d& p : x) square += (p - mean).cwiseProduct(p - mean) / count;
    square.maxCoeff(&along_);
    square[along_] = -1;
    // The width of a uniform distribution with the same variance. The extent of the vertices would
    // be too wide, because the few vertices of a ground lie far out.
    const double width = std::sqrt(12 * square.maxCoeff(&across_));
    if (!(width > 0 && std::isfinite(width))) return;
    strips_ = std::ceil(std::sqrt(static_cast<double>(boxes)));
    lower_ = mean[across_] - 0.5 * width;
    strips_per_metre_ = strips_ / width;
  }

  struct Box {
    Vector3d lower, upper;
    std::int32_t primitive;
    int strip;
  };

  // Makes the boxes of the primitives that may collide, one for each strip that a primitive
  // overlaps. Sorted by strip, then by lower end along the axis.
  template <class Primitive, class Filter>
  std::vector<Box> boxes_of(Span<const Primitive> primitives, const std::vector<Vector3d>& x,
                            const Filter& may_collide) const {
    std::vector<Box> boxes;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      if (!may_collide(primitives[i][0])) continue;
      Box box{x[primitives[i][0]], x[primitives[i][0]], static_cast<std::int32_t>(i), 0};
      for (const std::int32_t v : primitives[i]) {
        box.lower = box.lower.cwiseMin(x[v]);
        box.upper = box.upper.cwiseMax(x[v]);
      }
      const int last = strip(box.upper);
      for (box.strip = strip(box.lower); box.strip <= last; ++box.strip) boxes.push_back(box);
    }
    std::sort(boxes.begin(), boxes.end(),
              [this](const Box& a, const Box& b) { return place(a) < place(b); });
    return boxes;
  }

  // Calls test(a, b) once for each two boxes that overlap along the axis and share a strip.
  template <class Test>
  void sweep(const std::vector<Box>& a, const std::vector<Box>& b, Test&& test) const {
    // A pair is found at the lower end of the box that begins later.
    visit_starts(a, b, std::less<>(), test);
    visit_starts(b, a, std::less_equal<>(), [&](const Box& y, const Box& x) { test(x, y); });
  }

 private:
  // Index of the strip of a point. Points outside of the width are in the first or the last strip.
  int strip(const Vector3d& p) const {
    return static_cast<int>(std::clamp((p[across_] - lower_) * strips_per_metre_, 0.0, strips_));
  }
  std::pair<int, double> place(const Box& box) const { return {box.strip, box.lower[along_]}; }

  // Calls test() for each box of `b` that begins inside of a box of `a`.
  template <class Before, class Test>
  void visit_starts(const std::vector<Box>& a, const std::vector<Box>& b, Before before,
                    Test&& test) const {
    std::size_t j = 0;
    for (const Box& box : a) {
      while (j < b.size() && before(place(b[j]), place(box))) ++j;
      const std::pair<int, double> end(box.strip, box.upper[along_]);
      for (std::size_t k = j; k < b.size() && place(b[k]) <= end; ++k) {
        // Test a pair only in the first strip that both overlap.
        if (box.strip == std::max(strip(box.lower), strip(b[k].lower))) test(box, b[k]);
      }
    }
  }

  int along_ = 0, across_ = 1;
  double lower_ = 0, strips_per_metre_ = 0, strips_ = 0;
};

// Side of the plane abc on which the point p lies; 0 if rounding could decide the sign.
int side(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d u = a - p, v = b - p, w = c - p;
  const Vector3d au = u.cwiseAbs(), av = v.cwiseAbs(), aw = w.cwiseAbs();
  const double scale = au.maxCoeff() * av.maxCoeff() * aw.maxCoeff();
  const double volume = u.cross(v).dot(w);
  return std::abs(volume) > 1e-13 * scale ? (volume > 0 ? 1 : -1) : 0;
}

// By body: nonzero if it may collide with itself, or with a body whose box overlaps its own, and
// one of both is asked for.
std::vector<char> find_bodies_that_may_collide(const Topology& topology,
                                               const std::vector<Vector3d>& x,
                                               const PairRules& pair_rules,
                                               const std::vector<char>& is_asked_for) {
  std::vector<Box3d> boxes(topology.bodies.size());
  for (std::size_t v = 0; v < x.size(); ++v) boxes[topology.body_of_vertex[v]].extend(x[v]);
  std::vector<char> body_may_collide(boxes.size(), 0);
  const auto count = static_cast<std::int32_t>(boxes.size());
  for (std::int32_t a = 0; a < count; ++a) {
    if (!is_asked_for[a]) continue;
    for (std::int32_t b = 0; b < count; ++b) {
      if (b < a && is_asked_for[b]) continue;  // known from b
      if (boxes[a].intersects(boxes[b]) && pair_rules.collide(a, b))
        body_may_collide[a] = body_may_collide[b] = 1;
    }
  }
  return body_may_collide;
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
  std::vector<char> is_asked_for(topology.bodies.size(), of_bodies == nullptr);
  if (of_bodies != nullptr)
    for (const std::int32_t body : *of_bodies) is_asked_for[body] = 1;
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
  const std::vector<char> body_may_collide =
      find_bodies_that_may_collide(topology, x, pair_rules, is_asked_for);
  const auto may_collide = [&](std::int32_t v) {
    return body_may_collide[topology.body_of_vertex[v]] != 0;
  };
  const Strips strips(x, edges.size());
  strips.sweep(strips.boxes_of(edges, x, may_collide),
               strips.boxes_of(topology.faces, x, may_collide), test);
  return found;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
