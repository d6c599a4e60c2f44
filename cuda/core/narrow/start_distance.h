// Bounds of the distance of two primitives at the start of the step, in single precision, and what
// they say about contact reduction (core/narrow/contact_reduction.h). All backends compute the same
// bits. Their scales are different powers of two, which changes no bit unless the square of a
// distance underflows.
//
// Error bounds: each component of the scaled differences is off by one rounding. Each component of
// the gap between the points found is off by less than 8 roundings of `magnitude`, the sum of the
// components. The result does not rely on the points being the closest ones. Any two points give an
// upper bound of the distance, and any axis gives a lower bound.
#pragma once

#include "core/narrow/closest.h"
#include "core/narrow/contact_reduction.h"
#include "core/narrow/elementary.h"
#include "core/narrow/self_separation.h"

namespace lazyccd {

/// Differences at one end of the step, as Differences.
template <class T>
struct DifferencesAt {
  Vec3<T> e1, e2, r;
};

template <class T>
LAZYCCD_HD inline T size_of(const Vec3<T>& a) {
  return lane_abs(a.x) + lane_abs(a.y) + lane_abs(a.z);
}

/// Returns the smallest distance of the corners of one primitive from those of the other along an
/// axis, times the length of the axis.
template <ContactKind kind, class T>
LAZYCCD_HD inline T least_along(const Vec3<T>& axis, const DifferencesAt<T>& d) {
  const T zero(0.0f), at = dot(axis, d.r), along1 = dot(axis, d.e1), along2 = dot(axis, d.e2);
  return kind == ContactKind::vertex_face ? lane_min(at, lane_min(at - along1, at - along2))
                                          : at - lane_max(zero, along1) + lane_min(zero, along2);
}

/// Bound of the rounding error of a distance that is computed from components with the sum
/// `magnitude`.
template <class T>
LAZYCCD_HD inline T distance_rounding(const T& magnitude) {
  return T(32 * Roundoff<float>::u) * magnitude;
}

/// The gap between two points of two primitives.
template <class T>
struct Gap {
  Vec3<T> vector;
  T squared, length;

  LAZYCCD_HD explicit Gap(const Vec3<T>& v)
      : vector(v), squared(dot(v, v)), length(lane_sqrt(squared)) {}

  /// Returns a lower bound of the distance of the primitives with the differences d, measured along
  /// the gap; at least zero.
  template <ContactKind kind>
  LAZYCCD_HD T min_distance(const DifferencesAt<T>& d) const {
    const T zero(0.0f), magnitude = size_of(d.e1) + size_of(d.e2) + size_of(d.r);
    const T least = least_along<kind>(vector, d);
    return select(squared > T(Roundoff<float>::tiny),
                  // In this order: if a product overflows, the maximum of a NaN is zero.
                  lane_max(least / length - distance_rounding(magnitude), zero), zero);
  }
  /// Whether the primitives are certainly nearer than `distance`, which bounds cover rounding.
  LAZYCCD_HD MaskOf<T> is_below(const T& distance) const {
    return MaskOf<T>((distance > T(0.0f)) &
                     (squared + T(Roundoff<float>::tiny) < distance * distance));
  }
};

/// What is known of a pair at the start of the step.
template <class T>
struct StartDistance {
  ClosestPoints<T> points;
  Gap<T> gap;
  T size1, size2, magnitude;  // of e1, of e2, of all differences

  /// Whether the points lie on a border, and the pair is nearer than the separation of all pairs
  /// that may represent it. `least`: the least of these separations, scaled, a little less.
  template <ContactKind kind>
  LAZYCCD_HD MaskOf<T> may_be_redundant(const T& least, const T& border) const {
    return MaskOf<T>(border > T(0.0f)) &
           gap.is_below(least - distance_rounding(magnitude) -
                        border_width<kind>(points.u, points.v, size1, size2));
  }
};

template <ContactKind kind, class T>
LAZYCCD_HD inline StartDistance<T> start_distance(const DifferencesAt<T>& d) {
  const ClosestPoints<T> points = closest_points<kind>(d.e1, d.e2, d.r);
  const T size1 = size_of(d.e1), size2 = size_of(d.e2);
  return {points, Gap<T>(points.gap), size1, size2, size1 + size2 + size_of(d.r)};
}

/// Whether products with the scale of a step stay within the range of single precision.
LAZYCCD_HD inline bool fits_float(double scale) { return scale > 0x1p-120 && scale < 0x1p120; }

/// A separation times the scale, which does not fit.
LAZYCCD_HD inline float scaled_limit(double scale, float limit) {
  const double scaled = scale * limit;
  return static_cast<float>(scaled < 0x1p120 ? scaled : 0x1p120);
}

/// A distance below this is certainly below `separation`, which is scaled.
template <class T>
LAZYCCD_HD inline T certainly_within(const T& separation) {
  return separation * T(1 - 0x1p-18f);
}

/// The least separation of the pairs that may represent this one, scaled.
template <ContactKind kind>
LAZYCCD_HD inline float least_separation(const MeshView& mesh, const Separations& separation,
                                         double scale, Candidate pair) {
  const float between = static_cast<float>(scale * separation.between_bodies);
  if (separation.within_body == nullptr) return between;
  const SelfLimits limits = self_limits<kind>(mesh, separation.within_body, pair);
  const auto scaled = [&](float limit) {
    return fits_float(scale) ? static_cast<float>(scale) * limit : scaled_limit(scale, limit);
  };
  const float limit = lane_min(scaled(limits.smallest[0]), scaled(limits.smallest[1]));
  return lane_min(lane_max(limit, static_cast<float>(scale * separation.least())), between);
}

/// The differences of a query at the start of the step.
template <ContactKind kind>
LAZYCCD_HD inline DifferencesAt<float> differences_at_start(const QueryCoordinates& q,
                                                            double scale) {
  const auto difference = [&](int from, int to) -> Vec3<float> {
    const Vec3<double> d = q.start[to] - q.start[from];
    return {static_cast<float>(d.x * scale), static_cast<float>(d.y * scale),
            static_cast<float>(d.z * scale)};
  };
  if constexpr (kind == ContactKind::vertex_face) {
    return {difference(1, 2), difference(1, 3), difference(1, 0)};
  } else {
    return {difference(0, 1), difference(2, 3), difference(0, 2)};
  }
}

/// Whether another pair represents this one, if it is within its separation at the start. `pair` is
/// in the order of Contact.
template <ContactKind kind>
LAZYCCD_HD inline bool is_redundant_at_start(const MeshView& mesh, const FirstFaces& first,
                                             const Separations& separation, double scale,
                                             Candidate pair, const StartDistance<float>& at_start) {
  if (first.of == nullptr) return false;
  const float border = on_border<kind>(at_start.points.u, at_start.points.v);
  const float least = certainly_within(least_separation<kind>(mesh, separation, scale, pair));
  return at_start.template may_be_redundant<kind>(least, border) &&
         is_redundant_pair<kind>(mesh, first, pair, static_cast<int>(border));
}

}  // namespace lazyccd
