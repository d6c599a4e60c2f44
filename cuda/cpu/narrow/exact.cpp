#include "cpu/narrow/exact.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "cpu/narrow/polynomial.h"

namespace lazyccd {
namespace {

using exact::Instant;
using exact::Integer;
using exact::Polynomial;
using Vector = std::array<Polynomial, 3>;

Polynomial dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// A double as mantissa times 2^exponent. The mantissa is odd, or 0 for zero.
struct Dyadic {
  explicit Dyadic(double x)
      : mantissa(static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53))) {
    exponent -= 53;
    if (mantissa == 0) return;
    const std::int64_t lowest_bit = mantissa & -mantissa;
    mantissa /= lowest_bit;
    exponent += std::ilogb(static_cast<double>(lowest_bit));
  }
  int exponent;
  std::int64_t mantissa;
};

// The points of a query on an integer grid. An invertible linear map does not change whether and
// when primitives touch. So each axis has its own grid: the coarsest one that represents all
// coordinates.
class Motion {
 public:
  explicit Motion(const QueryPoints& points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::vector<Dyadic> values;
      int grid = std::numeric_limits<int>::max();
      for (const auto& point : points) {
        values.emplace_back(point[axis]);
        if (values.back().mantissa != 0) grid = std::min(grid, values.back().exponent);
      }
      for (std::size_t i = 0; i < points.size(); ++i)
        if (values[i].mantissa != 0)
          x_[i][axis] = Integer(values[i].mantissa)
                        << static_cast<unsigned>(values[i].exponent - grid);
    }
  }

  // Returns the vector from point i to point j, linear in time.
  Vector operator()(std::size_t i, std::size_t j) const {
    Vector v;
    for (std::size_t axis = 0; axis < 3; ++axis)
      v[axis] = {x_[j][axis] - x_[i][axis], x_[j + 4][axis] - x_[i + 4][axis]};
    return v;
  }

 private:
  std::array<std::array<Integer, 3>, 8> x_;
};

// Condition that point p lies on the closed segment ab, of any length: (p-a) x (p-b) = 0 and
// (p-a) . (p-b) <= 0. Holds the three components of the cross product, then the dot product.
using PointOnSegment = std::array<Polynomial, 4>;

// Returns the conditions that may hold at some time: face vertex against sides, or end of one edge
// against the other edge. Leaves out those with (p-a) . (p-b) > 0 during the whole step.
std::vector<PointOnSegment> point_segment_contacts(ContactKind kind, const Motion& difference) {
  using Triple = std::array<std::size_t, 3>;
  const std::vector<Triple> triples =
      kind == ContactKind::vertex_face
          ? std::vector<Triple>{{0, 1, 2}, {0, 2, 3}, {0, 3, 1}}
          : std::vector<Triple>{{0, 2, 3}, {1, 2, 3}, {2, 0, 1}, {3, 0, 1}};
  std::vector<PointOnSegment> contacts;
  for (const auto& [p, a, b] : triples) {
    const Vector ap = difference(a, p), bp = difference(b, p);
    const Polynomial between = dot(ap, bp);
    if (between.sign_changes() == 0 && between[0].sign() > 0 && between[2].sign() > 0) continue;
    const Vector c = cross(ap, bp);
    contacts.push_back({c[0], c[1], c[2], between});
  }
  return contacts;
}

bool holds(const PointOnSegment& contact, Instant& t) {
  return std::all_of(contact.begin(), contact.end() - 1,
                     [&](const Polynomial& p) { return t.sign(p) == 0; }) &&
         t.sign(contact[3]) <= 0;
}

// Returns component k of the polynomials that must not be negative, after multiplication by the
// sign of n[k], if the contact point is inside. At a root of f, r x e2 = u n and so on. So any
// component of n that is not zero there gives the signs of the barycentric coordinates.
std::vector<Polynomial> inside_conditions(ContactKind kind, const Motion& difference,
                                          const Vector& n, std::size_t k) {
  const auto component = [k](const Vector& a, const Vector& b) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    return a[i] * b[j] - a[j] * b[i];
  };
  if (kind == ContactKind::vertex_face) {
    const Vector e1 = difference(1, 2), e2 = difference(1, 3), r = difference(1, 0);
    const Polynomial u = component(r, e2), v = component(e1, r);
    return {u, v, n[k] - u - v};
  }
  const Vector e1 = difference(0, 1), e2 = difference(2, 3), r = difference(0, 2);
  const Polynomial u = component(r, e2), v = component(r, e1);
  return {u, n[k] - u, v, n[k] - v};
}

QueryResult hit(std::uint64_t ticks) { return {true, std::ldexp(static_cast<double>(ticks), -32)}; }

template <ContactKind kind>
bool decide_kind(const MeshView& mesh, Candidate pair, const Positions& start, const Positions& end,
                 Contact& contact) {
  identify_contact<kind>(mesh, pair, contact);
  QueryCoordinates q;
  for (int i = 0; i < 4; ++i) {
    const std::size_t v = static_cast<std::size_t>(contact.vertices[i]);
    q.start[i] = {start[v][0], start[v][1], start[v][2]};
    q.end[i] = {end[v][0], end[v][1], end[v][2]};
  }
  const Decision decision = decide_exactly(kind, q);
  if (decision.kind == Decision::miss) return false;
  contact.toi = static_cast<double>(decision.tick) * kTick;
  describe_contact<kind>(q, contact.toi, false, contact);
  return true;
}

}  // namespace

// A contact needs the four points in one plane: a root of the cubic f = n.r. At such a time the
// primitives touch if the inside conditions hold. If the normal vanishes (face or edges on one
// line), they touch if a point lies on a segment: the vertex on a side, or the end of one edge on
// the other.
QueryResult decide_exact(ContactKind kind, const QueryPoints& points) {
  const Motion difference(points);
  const bool is_vf = kind == ContactKind::vertex_face;
  const Vector n =
      is_vf ? cross(difference(1, 2), difference(1, 3)) : cross(difference(0, 1), difference(2, 3));
  const Polynomial f = dot(n, is_vf ? difference(1, 0) : difference(0, 2));
  if (f.sign_changes() == 0 && !f[0].is_zero() && !f[3].is_zero()) return {};

  std::array<std::vector<Polynomial>, 3> inside;
  std::optional<std::vector<PointOnSegment>> on_segment;
  const auto segment_contacts = [&]() -> const std::vector<PointOnSegment>& {
    if (!on_segment) on_segment = point_segment_contacts(kind, difference);
    return *on_segment;
  };
  const auto touches = [&](Instant& t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int normal = t.sign(n[k]);
      if (normal == 0) continue;
      if (inside[k].empty()) inside[k] = inside_conditions(kind, difference, n, k);
      return std::all_of(inside[k].begin(), inside[k].end(),
                         [&](const Polynomial& g) { return t.sign(g) * normal >= 0; });
    }
    return std::any_of(segment_contacts().begin(), segment_contacts().end(),
                       [&](const PointOnSegment& contact) { return holds(contact, t); });
  };

  if (!f.is_zero()) {
    auto t = first_root(f, touches);
    return t ? hit(t->ticks()) : QueryResult{};
  }

  // The points are in one plane at all times. After the start, the first contact is between a point
  // and a segment: a point inside a face, or two edges that cross, would have touched a little
  // earlier too.
  Instant start(0, 0);
  if (touches(start)) return hit(0);
  QueryResult first;
  for (const PointOnSegment& contact : segment_contacts()) {
    const auto p = std::find_if(contact.begin(), contact.end(),
                                [](const Polynomial& q) { return !q.is_zero(); });
    if (p == contact.end()) continue;
    auto t = first_root(*p, [&](Instant& s) { return holds(contact, s); });
    if (!t) continue;
    const QueryResult found = hit(t->ticks());
    if (!first.hit || found.toi < first.toi) first = found;
  }
  return first;
}

Decision decide_exactly(ContactKind kind, const QueryCoordinates& q) {
  QueryPoints points;
  for (int i = 0; i < 4; ++i) {
    points[i] = {q.start[i].x, q.start[i].y, q.start[i].z};
    points[4 + i] = {q.end[i].x, q.end[i].y, q.end[i].z};
  }
  const QueryResult result = decide_exact(kind, points);
  return {result.hit ? Decision::hit : Decision::miss,
          static_cast<std::int64_t>(result.toi / kTick)};
}

bool decide_exactly(ContactKind kind, const MeshView& mesh, Candidate pair, const Positions& start,
                    const Positions& end, Contact& contact) {
  return kind == ContactKind::vertex_face
             ? decide_kind<ContactKind::vertex_face>(mesh, pair, start, end, contact)
             : decide_kind<ContactKind::edge_edge>(mesh, pair, start, end, contact);
}

}  // namespace lazyccd
