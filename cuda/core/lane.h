// The few functions that the elementary tests need beyond + - * /, for scalars. FloatLanes and
// DoubleLanes (cpu/isa/) provide the same names for several lanes, with a mask in place of bool, so
// one source serves all.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

/// Properties of a number type: Mask, the result of a comparison, and Scalar, the type of one lane.
template <class T>
struct Lane;

template <>
struct Lane<float> {
  using Mask = bool;
  using Scalar = float;
};
template <>
struct Lane<double> {
  using Mask = bool;
  using Scalar = double;
};

template <class T>
using MaskOf = typename Lane<T>::Mask;

/// Constants of a precision.
///
/// u: the unit roundoff, half the distance from 1 to the next number.
///
/// tiny: covers underflow in every bound of core/narrow/elementary.h. All inputs there are at most
/// 2^6 in magnitude. A product or a rounded input that underflows is off by at most half the
/// smallest subnormal (2^-150, 2^-1075). That error is multiplied by at most three further factors
/// of 2^7, and occurs in fewer than 2^6 places.
template <class S>
struct Roundoff;
template <>
struct Roundoff<float> {
  static constexpr float u = 0x1p-24f;
  static constexpr float tiny = 0x1p-120f;
};
template <>
struct Roundoff<double> {
  static constexpr double u = 0x1p-53;
  static constexpr double tiny = 0x1p-1000;
};

LAZYCCD_HD inline float select(bool m, float a, float b) { return m ? a : b; }
LAZYCCD_HD inline double select(bool m, double a, double b) { return m ? a : b; }
LAZYCCD_HD inline float lane_min(float a, float b) { return a < b ? a : b; }
LAZYCCD_HD inline double lane_min(double a, double b) { return a < b ? a : b; }
LAZYCCD_HD inline float lane_max(float a, float b) { return a > b ? a : b; }
LAZYCCD_HD inline double lane_max(double a, double b) { return a > b ? a : b; }
LAZYCCD_HD inline float lane_abs(float a) { return ::fabsf(a); }
LAZYCCD_HD inline double lane_abs(double a) { return ::fabs(a); }
LAZYCCD_HD inline float lane_sqrt(float a) { return ::sqrtf(a); }
LAZYCCD_HD inline double lane_sqrt(double a) { return ::sqrt(a); }
LAZYCCD_HD inline float lane_floor(float a) { return ::floorf(a); }
LAZYCCD_HD inline double lane_floor(double a) { return ::floor(a); }
LAZYCCD_HD inline bool lane_any(bool m) { return m; }

/// Returns a quotient for estimates that nothing certified relies on. Less accurate on the device,
/// because it is faster there.
template <class T>
LAZYCCD_HD inline T estimated_quotient(const T& a, const T& b) {
  return a / b;
}
#if defined(__CUDA_ARCH__)
template <>
LAZYCCD_HD inline float estimated_quotient(const float& a, const float& b) {
  return __fdividef(a, b);
}
template <>
LAZYCCD_HD inline double estimated_quotient(const double& a, const double& b) {
  double inverse;  // to about 2^-20; the next line doubles its bits by Newton's method
  asm("rcp.approx.ftz.f64 %0, %1;" : "=d"(inverse) : "d"(b));
  return a * __fma_rn(inverse, __fma_rn(-b, inverse, 1.0), inverse);
}
#endif

/// The larger of the two magnitudes.
template <class T>
LAZYCCD_HD inline T max_abs(const T& a, const T& b) {
  return lane_max(lane_abs(a), lane_abs(b));
}

}  // namespace lazyccd
