// The public single tests of lazyccd/query.h.
#include <cmath>

#include "core/ieee_arithmetic.h"
#include "core/narrow/contact_math.h"
#include "core/narrow/separation.h"
#include "cpu/narrow/exact.h"
#include "host/scene/scale.h"
#include "lazyccd/error.h"
#include "lazyccd/query.h"

namespace lazyccd {
namespace {

double largest(const Differences<double>& d) {
  const Magnitudes<double> m = magnitudes(d);
  double all = 0;
  for (const Vec3<double>& v : {m.e1, m.e2, m.r})
    all = std::fmax(all, std::fmax(v.x, std::fmax(v.y, v.z)));
  return all;
}

Differences<float> rounded(const Differences<double>& d) {
  const auto to_float = [](const Vec3<double>& v) {
    return Vec3<float>{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  };
  Differences<float> s;
  for (int end = 0; end < 2; ++end) {
    s.e1[end] = to_float(d.e1[end]);
    s.e2[end] = to_float(d.e2[end]);
    s.r[end] = to_float(d.r[end]);
  }
  return s;
}

template <ContactKind kind>
Decision decide_in_float(const Differences<double>& d) {
  const Differences<float> s = rounded(d);
  const Magnitudes<float> m = magnitudes(s);
  const Verdict<float> v = decide_at_roots<kind>(s, m, coplanarity(s, m));
  if (v.miss) return {Decision::miss, 0};
  if (!v.hit) return {Decision::undecided, 0};
  return timed_hit(coplanarity(d, magnitudes(d)), v.lo, v.hi);
}

QueryCoordinates coordinates(const QueryPoints& points) {
  QueryCoordinates q;
  for (int i = 0; i < 4; ++i) {
    q.start[i] = {points[i][0], points[i][1], points[i][2]};
    q.end[i] = {points[4 + i][0], points[4 + i][1], points[4 + i][2]};
  }
  return q;
}

QueryResult result_of(const Decision& decision) {
  return {decision.kind == Decision::hit, static_cast<double>(decision.tick) * kTick};
}

template <ContactKind kind>
QueryResult decide(const QueryPoints& points, Stage& stage) {
  const QueryCoordinates q = coordinates(points);
  stage = Stage::single_precision;
  if (separated_along_axes<kind>(q)) return {};

  const double size = largest(differences<kind>(q, 1.0));
  if (size > 1e-280 && size < 1e280) {
    const Differences<double> d = differences<kind>(q, scale_for(size));
    Decision decision = decide_in_float<kind>(d);
    if (decision.kind == Decision::undecided) {
      stage = Stage::double_precision;
      decision = decide_in_double<kind>(d);
    }
    if (decision.kind != Decision::undecided) return result_of(decision);
  }
  stage = Stage::exact;
  return decide_exact(kind, points);
}

template <ContactKind kind>
QueryResult decide_within(const QueryPoints& points, double separation) {
  const QueryCoordinates q = coordinates(points);
  const double scale = scale_for(largest(differences<kind>(q, 1.0)));
  return result_of(decide_within<kind>(q, separation, scale));
}

void check_finite(const QueryPoints& points) {
  for (const auto& point : points)
    for (const double x : point)
      if (!std::isfinite(x))
        throw Error(ErrorCode::non_finite_position, "a position of the query is not finite");
}

}  // namespace

QueryResult decide(ContactKind kind, const QueryPoints& points, Stage* stage) {
  check_finite(points);
  const IeeeArithmetic ieee;
  Stage used;
  const QueryResult result = kind == ContactKind::vertex_face
                                 ? decide<ContactKind::vertex_face>(points, used)
                                 : decide<ContactKind::edge_edge>(points, used);
  if (stage) *stage = used;
  return result;
}

QueryResult decide_within(ContactKind kind, const QueryPoints& points, double separation) {
  if (!(separation >= 0 && std::isfinite(separation)))
    throw Error(ErrorCode::invalid_argument, "separation is negative or not finite");
  if (separation == 0) return decide(kind, points);
  check_finite(points);
  const IeeeArithmetic ieee;
  return kind == ContactKind::vertex_face
             ? decide_within<ContactKind::vertex_face>(points, separation)
             : decide_within<ContactKind::edge_edge>(points, separation);
}

}  // namespace lazyccd
