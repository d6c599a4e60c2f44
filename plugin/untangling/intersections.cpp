#include "untangling/intersections.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

#include "lazyccd/query.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// Boxes are swept along the scene's longest axis, in strips across its second longest: swept as a
// whole, a cloth is a line of boxes as long as it is wide at each place.
class Strips {
 public:
  Strips(const std::vector<Vector3d>& x, std::size_t boxes) {
    if (x.empty()) return;
    const double count = static_cast<double>(x.size());
    Vector3d mean = Vector3d::Zero(), square = Vector3d::Zero();
    for (const Vector3d& p : x) mean += p / count;
    for (const Vector3d& p : x) square += (p - mean).cwiseAbs2() / count;
    square.maxCoeff(&along_);
    square[along_] = -1;
    // As wide as what is spread evenly would be: the few vertices of a ground are far out.
    const double width = std::sqrt(12 * square.maxCoeff(&across_));
    if (!(width > 0 && std::isfinite(width))) return;
    strips_ = std::ceil(std::sqrt(static_cast<double>(boxes)));
    lower_ = mean[across_] - 0.5 * width;
    per_metre_ = strips_ / width;
  }

  struct Box {
    Vector3d lower, upper;
    std::int32_t primitive;
    int strip;
  };

  // Of the primitives that count, a box for each strip that they are in, by strip and where they
  // begin along the axis.
  template <class Primitive, class Counts>
  std::vector<Box> boxes_of(Span<const Primitive> primitives, const std::vector<Vector3d>& x,
                            const Counts& counts) const {
    std::vector<Box> boxes;
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      if (!counts(primitives[i][0])) continue;
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

  // test(a, b) once for each two boxes that overlap along the axis and share a strip.
  template <class Test>
  void sweep(const std::vector<Box>& a, const std::vector<Box>& b, Test&& test) const {
    // Such two are seen where the later one of them begins.
    begin_in(a, b, std::less<>(), test);
    begin_in(b, a, std::less_equal<>(), [&](const Box& y, const Box& x) { test(x, y); });
  }

 private:
  // What is further out is in the first or the last.
  int strip(const Vector3d& p) const {
    return static_cast<int>(std::clamp((p[across_] - lower_) * per_metre_, 0.0, strips_));
  }
  std::pair<int, double> place(const Box& box) const { return {box.strip, box.lower[along_]}; }

  // Those of b that begin inside of one of a.
  template <class Before, class Test>
  void begin_in(const std::vector<Box>& a, const std::vector<Box>& b, Before before,
                Test&& test) const {
    std::size_t j = 0;
    for (const Box& box : a) {
      while (j < b.size() && before(place(b[j]), place(box))) ++j;
      const std::pair<int, double> end(box.strip, box.upper[along_]);
      for (std::size_t k = j; k < b.size() && place(b[k]) <= end; ++k) {
        // In the first strip that both are in.
        if (box.strip == std::max(strip(box.lower), strip(b[k].lower))) test(box, b[k]);
      }
    }
  }

  int along_ = 0, across_ = 1;
  double lower_ = 0, per_metre_ = 0, strips_ = 0;
};

// On which side of the plane abc the point p is; 0 where rounding could have decided.
int side(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d u = a - p, v = b - p, w = c - p;
  const Vector3d au = u.cwiseAbs(), av = v.cwiseAbs(), aw = w.cwiseAbs();
  const double most = au.maxCoeff() * av.maxCoeff() * aw.maxCoeff();
  const double volume = u.cross(v).dot(w);
  return std::abs(volume) > 1e-13 * most ? (volume > 0 ? 1 : -1) : 0;
}

// The ends are certainly on different sides, so what is left is exact: whether a point that goes
// along the edge meets the face.
bool pierces(const Vector3d& p, const Vector3d& q, const Vector3d& a, const Vector3d& b,
             const Vector3d& c) {
  if (side(p, a, b, c) * side(q, a, b, c) >= 0) return false;
  const auto point = [](const Vector3d& x) { return std::array<double, 3>{x[0], x[1], x[2]}; };
  return decide(ContactKind::vertex_face,
                {point(p), point(a), point(b), point(c), point(q), point(a), point(b), point(c)})
      .hit;
}

class Rules {
 public:
  Rules(const Topology& t, const std::function<bool(std::int32_t)>& responds)
      : t_(t), responds_(responds) {
    for (const BodyPair& pair : t.disabled_pairs)
      disabled_.insert({std::min(pair[0], pair[1]), std::max(pair[0], pair[1])});
  }
  bool collide(std::int32_t a, std::int32_t b) const {
    if (!responds_(a) || !responds_(b)) return false;
    if (a == b) return t_.bodies[a].self_collision;
    return (t_.bodies[a].group & t_.bodies[b].mask) && (t_.bodies[b].group & t_.bodies[a].mask) &&
           !disabled_.count({std::min(a, b), std::max(a, b)});
  }

 private:
  const Topology& t_;
  const std::function<bool(std::int32_t)>& responds_;
  std::set<BodyPair> disabled_;
};

// By body: whether it may collide with one whose box overlaps its own, or with itself.
std::vector<char> with_others(const Topology& t, const std::vector<Vector3d>& x,
                              const Rules& rules) {
  std::vector<Eigen::AlignedBox3d> boxes(t.bodies.size());
  for (std::size_t v = 0; v < x.size(); ++v) boxes[t.body_of_vertex[v]].extend(x[v]);
  std::vector<char> with(boxes.size(), 0);
  const auto count = static_cast<std::int32_t>(boxes.size());
  for (std::int32_t a = 0; a < count; ++a) {
    for (std::int32_t b = a; b < count; ++b) {
      if (boxes[a].intersects(boxes[b]) && rules.collide(a, b)) with[a] = with[b] = 1;
    }
  }
  return with;
}

}  // namespace

Intersections find_intersections(const Topology& topology, Span<const Edge> edges,
                         const Positions& positions,
                         const std::function<bool(std::int32_t)>& responds,
                         const std::function<bool(const Edge&, const Face&)>& held) {
  std::vector<Vector3d> x;
  for (std::size_t i = 0; i < positions.count(); ++i) {
    const std::array<double, 3> p = positions[i];
    x.emplace_back(p[0], p[1], p[2]);
  }
  const Rules rules(topology, responds);
  const auto movable = [&](std::int32_t v) { return topology.inverse_mass[v] > 0; };
  Intersections found;
  const auto test = [&](const Strips::Box& edge_box, const Strips::Box& face_box) {
    if ((edge_box.lower.array() > face_box.upper.array()).any() ||
        (face_box.lower.array() > edge_box.upper.array()).any())
      return;
    const Edge& e = edges[edge_box.primitive];
    const Face& f = topology.faces[face_box.primitive];
    for (const std::int32_t v : f) {
      if (v == e[0] || v == e[1]) return;
    }
    const std::int32_t a = topology.body_of_vertex[e[0]], b = topology.body_of_vertex[f[0]];
    const bool moves =
        std::any_of(e.begin(), e.end(), movable) || std::any_of(f.begin(), f.end(), movable);
    if (!moves || !rules.collide(a, b) || !pierces(x[e[0]], x[e[1]], x[f[0]], x[f[1]], x[f[2]]) ||
        held(e, f))
      return;
    if (found.pairs.empty()) found.first = {a, b};
    found.pairs.push_back({edge_box.primitive, face_box.primitive});
  };
  const std::vector<char> with = with_others(topology, x, rules);
  const auto counts = [&](std::int32_t v) { return with[topology.body_of_vertex[v]] != 0; };
  const Strips strips(x, edges.size());
  strips.sweep(strips.boxes_of(edges, x, counts), strips.boxes_of(topology.faces, x, counts), test);
  return found;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
