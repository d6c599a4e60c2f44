// Interval subdivision in the manner of Tight-Inclusion (Wang et al. 2021); see peer.h.
#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <vector>

#include "bench/peers/peer.h"
#include "bench/peers/vec3.h"

namespace lazyccd::peers {
namespace {

constexpr double tolerance = 1e-6;        // of the distance on each axis, unit of the coordinates
constexpr int iteration_limit = 1000000;  // number of boxes; beyond it the answer is "hit"

// A box [lo, lo + width] in time (0) and in the two parameters of the primitives (1, 2). Its ends
// are dyadic, so halving is exact until the width reaches the precision.
template <class Real>
struct Box {
  Real lo[3], width[3];
  int level;
};

// Order of the queue: breadth first, and within a level by time.
template <class Real>
struct Later {
  bool operator()(const Box<Real>& x, const Box<Real>& y) const {
    return x.level != y.level ? x.level > y.level : x.lo[0] > y.lo[0];
  }
};

// A query. The vector between the primitives is linear in each of t, u and v alone, so its range
// over a box is the range over the eight corners.
//   vertex_face: p0 - (1-u-v) p1 - u p2 - v p3;  edge_edge: (1-u) p0 + u p1 - (1-v) p2 - v p3
template <class Real>
struct Query {
  ContactKind kind;
  std::array<Vec3<Real>, 8> x;
  Vec3<Real> error;  // bound of the rounding error at one corner, by axis
  Real narrow[3];    // widths at which a box spans at most the tolerance

  // Returns the range over a box on one axis.
  std::array<Real, 2> range(const Box<Real>& box, int axis) const {
    const Real u[2] = {box.lo[1], box.lo[1] + box.width[1]};
    const Real v[2] = {box.lo[2], box.lo[2] + box.width[2]};
    Real low = std::numeric_limits<Real>::max(), high = -low;
    for (const Real t : {box.lo[0], box.lo[0] + box.width[0]}) {
      Real p[4];
      for (int i = 0; i < 4; ++i) p[i] = (1 - t) * x[i][axis] + t * x[i + 4][axis];
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) {
          const Real value =
              kind == ContactKind::vertex_face
                  ? p[0] - ((1 - u[i] - v[j]) * p[1] + u[i] * p[2] + v[j] * p[3])
                  : ((1 - u[i]) * p[0] + u[i] * p[1]) - ((1 - v[j]) * p[2] + v[j] * p[3]);
          low = std::min(low, value);
          high = std::max(high, value);
        }
    }
    return {low, high};
  }
};

template <class Real>
Real spread(const Vec3<Real>& a) {
  return std::max({std::abs(a[0]), std::abs(a[1]), std::abs(a[2])});
}

template <class Real>
Query<Real> prepare(ContactKind kind, const QueryPoints& points) {
  Query<Real> q{kind, rounded<Real>(points), {}, {}};
  // Bound of the rounding error. M is the largest |coordinate| on the axis; r = epsilon / 2 is the
  // unit roundoff.
  //   A point: rounding of the input r M; two products, a sum and 1-t: 3 r M.
  //   A combination of points (the weights sum to at most 3 in magnitude, since a box may reach
  //   beyond the face): the points 12 r M, the weights 2 r M, products and sums 9 r M.
  //   The difference to the other side: 4 r M each.
  // The sum is 31 r M; 40 r M also covers the products of errors. The bound is linear in M, because
  // only the points have a scale.
  for (int axis = 0; axis < 3; ++axis) {
    Real largest = 0;
    for (const Vec3<Real>& p : q.x) largest = std::max(largest, std::abs(p[axis]));
    q.error[axis] = 20 * std::numeric_limits<Real>::epsilon() * largest;
  }
  const auto& x = q.x;
  Real span[3] = {0, 0, 0};
  for (int i = 0; i < 4; ++i) span[0] = std::max(span[0], spread(x[i + 4] - x[i]));
  for (int end = 0; end < 8; end += 4) {
    const bool vf = kind == ContactKind::vertex_face;
    span[1] = std::max(span[1], vf ? spread(x[end + 2] - x[end + 1]) : spread(x[end + 1] - x[end]));
    span[2] =
        std::max(span[2], vf ? spread(x[end + 3] - x[end + 1]) : spread(x[end + 3] - x[end + 2]));
  }
  span[0] *= 2;  // both primitives move
  for (int i = 0; i < 3; ++i)
    q.narrow[i] = span[i] > 0 ? Real(tolerance) / (3 * span[i]) : std::numeric_limits<Real>::max();
  return q;
}

// empty: holds no contact; narrow: may hold one and need not be split; undecided: must be split.
enum class Verdict { empty, narrow, undecided };

template <class Real>
Verdict classify(const Query<Real>& q, const Box<Real>& box) {
  bool within_tolerance = true;
  for (int axis = 0; axis < 3; ++axis) {
    const auto [low, high] = q.range(box, axis);
    if (low > q.error[axis] || high < -q.error[axis]) return Verdict::empty;
    within_tolerance = within_tolerance && high - low <= Real(tolerance);
  }
  const bool narrow =
      box.width[0] <= q.narrow[0] && box.width[1] <= q.narrow[1] && box.width[2] <= q.narrow[2];
  return within_tolerance || narrow ? Verdict::narrow : Verdict::undecided;
}

}  // namespace

template <class Real>
QueryResult interval_subdivision(ContactKind kind, const QueryPoints& points) {
  const Query<Real> q = prepare<Real>(kind, points);
  std::priority_queue<Box<Real>, std::vector<Box<Real>>, Later<Real>> queue;
  queue.push({{0, 0, 0}, {1, 1, 1}, 0});
  constexpr Real never = 2;
  Real narrow_at = never;  // start of the earliest narrow box that may hold a contact
  // No contact is before this time: the start of the level's first box that may hold one.
  Real earliest = 0;
  int level = -1, iterations = 0;
  while (!queue.empty()) {
    const Box<Real> box = queue.top();
    queue.pop();
    if (box.lo[0] >= narrow_at) continue;
    if (++iterations > iteration_limit) return {true, double(std::min(earliest, narrow_at))};
    const Verdict verdict = classify(q, box);
    if (verdict == Verdict::empty) continue;
    const bool first = box.level != level;
    if (first) {
      level = box.level;
      earliest = box.lo[0];
    }
    // Split the dimension whose width is largest relative to its `narrow` width, unless no number
    // lies between its ends.
    int split = 0;
    for (int i = 1; i < 3; ++i)
      if (box.width[i] / q.narrow[i] > box.width[split] / q.narrow[split]) split = i;
    const Real half = box.width[split] / 2, middle = box.lo[split] + half;
    if (verdict == Verdict::narrow || middle == box.lo[split] + box.width[split]) {
      if (first) return {true, double(box.lo[0])};
      narrow_at = std::min(narrow_at, box.lo[0]);
      continue;
    }
    Box<Real> child = box;
    child.level = box.level + 1;
    child.width[split] = half;
    queue.push(child);
    child.lo[split] = middle;
    const bool outside = kind == ContactKind::vertex_face && child.lo[1] + child.lo[2] > 1;
    if (!outside) queue.push(child);
  }
  return {narrow_at < never, double(narrow_at < never ? narrow_at : 0)};
}

template QueryResult interval_subdivision<float>(ContactKind, const QueryPoints&);
template QueryResult interval_subdivision<double>(ContactKind, const QueryPoints&);

}  // namespace lazyccd::peers
