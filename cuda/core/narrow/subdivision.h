// Decides the queries that roots.h leaves undecided, by binary subdivision of the step, depth first
// from its start. It stops at the first part that certainly holds the first contact; all parts
// before it are certainly free of contact.
#pragma once

#include <cstdint>

#include "core/narrow/closest.h"
#include "core/narrow/roots.h"

namespace lazyccd {

/// Whether the primitives are certainly apart during [lo, hi]: all corners of one lie on one side
/// of the other, along the axis through the closest points at the middle time. The corners move
/// linearly, so both ends suffice.
template <ContactKind kind>
LAZYCCD_HD inline bool separated(const Differences<double>& d, const Magnitudes<double>& m,
                                 double lo, double hi) {
  const double mid = 0.5 * (lo + hi);
  const Vec3<double> axis =
      closest_points<kind, EstimatedDivision>(lerp(d.e1, mid), lerp(d.e2, mid), lerp(d.r, mid)).gap;
  const Vec3<double> axis_abs{lane_abs(axis.x), lane_abs(axis.y), lane_abs(axis.z)};
  const double bound =
      16 * Roundoff<double>::u * dot(axis_abs, m.r + m.e1 + m.e2) + Roundoff<double>::tiny;
  const double r0 = dot(axis, d.r[0]), r1 = dot(axis, d.r[1]);
  const double a0 = dot(axis, d.e1[0]), a1 = dot(axis, d.e1[1]);
  const double b0 = dot(axis, d.e2[0]), b1 = dot(axis, d.e2[1]);
  const double times[2] = {lo, hi};
  for (const double t : times) {
    const double r = lerp(r0, r1, t), e1 = lerp(a0, a1, t), e2 = lerp(b0, b1, t);
    const bool apart = kind == ContactKind::vertex_face
                           ? r > bound && r - e1 > bound && r - e2 > bound
                           : r > bound && r - e1 > bound && r + e2 > bound && r + e2 - e1 > bound;
    if (!apart) return false;
  }
  return true;
}

/// Whether f has exactly one root, by Descartes' rule: certain signs at both ends, and one change
/// of sign among the coefficients.
LAZYCCD_HD inline bool has_one_root(const Cubic<double>& f) {
  const double sign = f.k[0] < 0 ? -1 : 1;
  return sign * f.k[0] > f.bound && sign * f.k[3] < -f.bound &&
         (sign * f.k[1] > f.bound || sign * f.k[2] < -f.bound);
}

/// Decides by subdivision. Gives up, undecided, after 400 parts, or when a part of 2^-20 of the
/// step is still unclear. At that size the case is usually a tie (a degenerate touch).
template <ContactKind kind>
LAZYCCD_HD inline Verdict<double> decide_by_subdivision(const Differences<double>& d,
                                                        const Magnitudes<double>& m,
                                                        const Cubic<double>& f) {
  std::uint64_t part = 0;
  int level = 0;
  for (int visited = 0; visited < 400; ++visited) {
    const double width = 1.0 / static_cast<double>(std::uint64_t{1} << level);
    const double lo = static_cast<double>(part) * width, hi = lo + width;
    const Cubic<double> local = f.on(lo, hi);
    const Inside<double> inside = inside_conditions<kind>(d, m, lo + 0.5 * width, 0.5 * width);
    if (!local.no_root() && !inside.any_negative && !separated<kind>(d, m, lo, hi)) {
      if (inside.all_positive && has_one_root(local)) return {true, false, lo, hi};
      if (level == 20) return {false, false, 0, 0};
      ++level;
      part <<= 1;
      continue;
    }
    while (level > 0 && (part & 1)) {
      part >>= 1;
      --level;
    }
    if (level == 0) return {false, true, 0, 0};
    ++part;
  }
  return {false, false, 0, 0};
}

/// Returns the time of impact in units of 2^-32, rounded down; -1 if double precision cannot tell.
/// f must have one root in [lo, hi] and certain signs at both.
LAZYCCD_HD inline std::int64_t impact_tick(const Cubic<double>& f, double lo, double hi) {
  const double sign = f.at(lo) < 0 ? -1 : 1;
  const double ticks = 4294967296.0;
  // Most roots need only a few steps.
  LAZYCCD_ONE_COPY
  for (const int iterations : {4, 40}) {
    const double below = lane_floor(estimate_root(f, sign, lo, hi, iterations) * ticks);
    if (!(below >= 0 && below <= ticks)) continue;
    const double a = lane_max(below / ticks, lo), b = lane_min((below + 1) / ticks, hi);
    if (a < b && sign * f.at(a) > f.bound && sign * f.at(b) < -f.bound)
      return static_cast<std::int64_t>(below);
  }
  return -1;
}

}  // namespace lazyccd
