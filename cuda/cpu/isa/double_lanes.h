// Packs of double lanes, like those of float in float_lanes.h, for tests in double precision.
#pragma once

#include "core/narrow/contact_math.h"
#include "cpu/isa/float_lanes.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

#if defined(__AVX512F__)

struct WideMask {
  __mmask8 m;
  LAZYCCD_INLINE unsigned bits() const { return m; }
};
LAZYCCD_INLINE WideMask operator&(WideMask a, WideMask b) {
  return {static_cast<__mmask8>(a.m & b.m)};
}
LAZYCCD_INLINE WideMask operator|(WideMask a, WideMask b) {
  return {static_cast<__mmask8>(a.m | b.m)};
}
LAZYCCD_INLINE WideMask operator!(WideMask a) { return {static_cast<__mmask8>(~a.m)}; }

struct DoubleLanes {
  static constexpr int lanes = 8;
  __m512d v;
  DoubleLanes() = default;
  LAZYCCD_INLINE DoubleLanes(__m512d x) : v(x) {}
  LAZYCCD_INLINE explicit DoubleLanes(double x) : v(_mm512_set1_pd(x)) {}
  static LAZYCCD_INLINE DoubleLanes load(const double* p) { return _mm512_load_pd(p); }
  LAZYCCD_INLINE void store(double* p) const { _mm512_store_pd(p, v); }
};
LAZYCCD_INLINE DoubleLanes operator-(DoubleLanes a) {
  return _mm512_castsi512_pd(
      _mm512_xor_si512(_mm512_castpd_si512(a.v), _mm512_set1_epi64(INT64_MIN)));
}
LAZYCCD_INLINE WideMask operator<(DoubleLanes a, DoubleLanes b) {
  return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_LT_OQ)};
}
LAZYCCD_INLINE WideMask operator<=(DoubleLanes a, DoubleLanes b) {
  return {_mm512_cmp_pd_mask(a.v, b.v, _CMP_LE_OQ)};
}
LAZYCCD_INLINE DoubleLanes select(WideMask m, DoubleLanes a, DoubleLanes b) {
  return _mm512_mask_blend_pd(m.m, b.v, a.v);
}
LAZYCCD_INLINE DoubleLanes lane_min(DoubleLanes a, DoubleLanes b) {
  return _mm512_min_pd(a.v, b.v);
}
LAZYCCD_INLINE DoubleLanes lane_max(DoubleLanes a, DoubleLanes b) {
  return _mm512_max_pd(a.v, b.v);
}
LAZYCCD_INLINE DoubleLanes lane_abs(DoubleLanes a) { return _mm512_abs_pd(a.v); }
LAZYCCD_INLINE DoubleLanes lane_sqrt(DoubleLanes a) { return _mm512_sqrt_pd(a.v); }

#elif defined(__AVX2__)

struct WideMask {
  __m256d m;
  LAZYCCD_INLINE unsigned bits() const { return static_cast<unsigned>(_mm256_movemask_pd(m)); }
};
LAZYCCD_INLINE WideMask operator&(WideMask a, WideMask b) { return {_mm256_and_pd(a.m, b.m)}; }
LAZYCCD_INLINE WideMask operator|(WideMask a, WideMask b) { return {_mm256_or_pd(a.m, b.m)}; }
LAZYCCD_INLINE WideMask operator!(WideMask a) {
  return {_mm256_xor_pd(a.m, _mm256_castsi256_pd(_mm256_set1_epi32(-1)))};
}

struct DoubleLanes {
  static constexpr int lanes = 4;
  __m256d v;
  DoubleLanes() = default;
  LAZYCCD_INLINE DoubleLanes(__m256d x) : v(x) {}
  LAZYCCD_INLINE explicit DoubleLanes(double x) : v(_mm256_set1_pd(x)) {}
  static LAZYCCD_INLINE DoubleLanes load(const double* p) { return _mm256_load_pd(p); }
  LAZYCCD_INLINE void store(double* p) const { _mm256_store_pd(p, v); }
};
LAZYCCD_INLINE DoubleLanes operator-(DoubleLanes a) {
  return _mm256_xor_pd(a.v, _mm256_set1_pd(-0.0));
}
LAZYCCD_INLINE WideMask operator<(DoubleLanes a, DoubleLanes b) {
  return {_mm256_cmp_pd(a.v, b.v, _CMP_LT_OQ)};
}
LAZYCCD_INLINE WideMask operator<=(DoubleLanes a, DoubleLanes b) {
  return {_mm256_cmp_pd(a.v, b.v, _CMP_LE_OQ)};
}
LAZYCCD_INLINE DoubleLanes select(WideMask m, DoubleLanes a, DoubleLanes b) {
  return _mm256_blendv_pd(b.v, a.v, m.m);
}
LAZYCCD_INLINE DoubleLanes lane_min(DoubleLanes a, DoubleLanes b) {
  return _mm256_min_pd(a.v, b.v);
}
LAZYCCD_INLINE DoubleLanes lane_max(DoubleLanes a, DoubleLanes b) {
  return _mm256_max_pd(a.v, b.v);
}
LAZYCCD_INLINE DoubleLanes lane_abs(DoubleLanes a) {
  return _mm256_andnot_pd(_mm256_set1_pd(-0.0), a.v);
}
LAZYCCD_INLINE DoubleLanes lane_sqrt(DoubleLanes a) { return _mm256_sqrt_pd(a.v); }

#else  // two lanes

using Double2 = SimdVector<double, 2>;
using Long2 = SimdVector<std::int64_t, 2>;

struct WideMask {
  Long2 m;
  LAZYCCD_INLINE unsigned bits() const { return (m[0] & 1u) | (m[1] & 2u); }
};
LAZYCCD_INLINE WideMask operator&(WideMask a, WideMask b) { return {a.m & b.m}; }
LAZYCCD_INLINE WideMask operator|(WideMask a, WideMask b) { return {a.m | b.m}; }
LAZYCCD_INLINE WideMask operator!(WideMask a) { return {~a.m}; }

struct DoubleLanes {
  static constexpr int lanes = 2;
  Double2 v;
  DoubleLanes() = default;
  LAZYCCD_INLINE DoubleLanes(Double2 x) : v(x) {}
  LAZYCCD_INLINE explicit DoubleLanes(double x) : v{x, x} {}
  static LAZYCCD_INLINE DoubleLanes load(const double* p) {
    return *reinterpret_cast<const Double2*>(p);
  }
  LAZYCCD_INLINE void store(double* p) const { *reinterpret_cast<Double2*>(p) = v; }
};
LAZYCCD_INLINE DoubleLanes operator-(DoubleLanes a) { return -a.v; }
LAZYCCD_INLINE WideMask operator<(DoubleLanes a, DoubleLanes b) { return {a.v < b.v}; }
LAZYCCD_INLINE WideMask operator<=(DoubleLanes a, DoubleLanes b) { return {a.v <= b.v}; }
LAZYCCD_INLINE DoubleLanes select(WideMask m, DoubleLanes a, DoubleLanes b) {
  return bit_cast<Double2>((m.m & bit_cast<Long2>(a.v)) | (~m.m & bit_cast<Long2>(b.v)));
}
LAZYCCD_INLINE DoubleLanes lane_min(DoubleLanes a, DoubleLanes b) { return select(a < b, a, b); }
LAZYCCD_INLINE DoubleLanes lane_max(DoubleLanes a, DoubleLanes b) {
  return select({b.v < a.v}, a, b);
}
LAZYCCD_INLINE DoubleLanes lane_abs(DoubleLanes a) {
  return bit_cast<Double2>(bit_cast<Long2>(a.v) & INT64_MAX);
}
LAZYCCD_INLINE DoubleLanes lane_sqrt(DoubleLanes a) { return square_root(a.v); }

#endif

LAZYCCD_INLINE DoubleLanes operator+(DoubleLanes a, DoubleLanes b) { return a.v + b.v; }
LAZYCCD_INLINE DoubleLanes operator-(DoubleLanes a, DoubleLanes b) { return a.v - b.v; }
LAZYCCD_INLINE DoubleLanes operator*(DoubleLanes a, DoubleLanes b) { return a.v * b.v; }
LAZYCCD_INLINE DoubleLanes operator/(DoubleLanes a, DoubleLanes b) { return a.v / b.v; }
LAZYCCD_INLINE WideMask operator>(DoubleLanes a, DoubleLanes b) { return b < a; }
LAZYCCD_INLINE WideMask operator>=(DoubleLanes a, DoubleLanes b) { return b <= a; }
LAZYCCD_INLINE bool lane_any(WideMask m) { return m.bits() != 0; }
// As unit_scale(double) in core/narrow/contact_math.h.
LAZYCCD_INLINE DoubleLanes unit_scale(DoubleLanes size) {
  using Bits = SimdVector<std::uint64_t, DoubleLanes::lanes>;
  using Exponent = SimdVector<std::int64_t, DoubleLanes::lanes>;
  const Exponent exponent = bit_cast<Exponent>(bit_cast<Bits>(size.v) >> 52);
  const Exponent one = Exponent{} + 1;
  const Exponent inverse = choose(exponent < 2046, 2046 - exponent, one);
  const DoubleLanes scale = bit_cast<SimdVector<double, DoubleLanes::lanes>>(inverse << 52);
  const WideMask normal =
      (DoubleLanes(0x1p-1020) < size) & (size <= DoubleLanes(0x1.fffffffffffffp1023));
  return select(normal, scale, DoubleLanes(1.0));
}

}  // namespace LAZYCCD_ISA

template <>
struct Lane<LAZYCCD_ISA::DoubleLanes> {
  using Mask = LAZYCCD_ISA::WideMask;
  using Scalar = double;
};

}  // namespace lazyccd
