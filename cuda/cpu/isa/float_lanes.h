// Packs of float lanes, as wide as the instruction set that this file is compiled for. They have
// the functions of core/lane.h, so that the elementary tests run on packs as they do on single
// numbers.
//
// Everything is in a namespace named after the instruction set and always inlined: the linker must
// never merge code for one set with code for another.
#pragma once

#include <cstdint>

#if defined(LAZYCCD_PLAIN_CPP)
#elif defined(__SSE2__)
#include <immintrin.h>
#elif defined(__aarch64__)
#include <arm_neon.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

#include "core/lane.h"
#include "simd/vector.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

#if defined(__AVX512F__)

struct Mask {
  __mmask16 m;
  LAZYCCD_INLINE unsigned bits() const { return m; }
};
LAZYCCD_INLINE Mask operator&(Mask a, Mask b) { return {static_cast<__mmask16>(a.m & b.m)}; }
LAZYCCD_INLINE Mask operator|(Mask a, Mask b) { return {static_cast<__mmask16>(a.m | b.m)}; }
LAZYCCD_INLINE Mask operator!(Mask a) { return {static_cast<__mmask16>(~a.m)}; }

struct FloatLanes {
  static constexpr int lanes = 16;
  __m512 v;
  FloatLanes() = default;
  LAZYCCD_INLINE FloatLanes(__m512 x) : v(x) {}
  LAZYCCD_INLINE explicit FloatLanes(float x) : v(_mm512_set1_ps(x)) {}
  static LAZYCCD_INLINE FloatLanes load(const float* p) { return _mm512_load_ps(p); }
  LAZYCCD_INLINE void store(float* p) const { _mm512_store_ps(p, v); }
};
LAZYCCD_INLINE FloatLanes operator-(FloatLanes a) {
  return _mm512_castsi512_ps(
      _mm512_xor_si512(_mm512_castps_si512(a.v), _mm512_set1_epi32(INT32_MIN)));
}
LAZYCCD_INLINE Mask operator<(FloatLanes a, FloatLanes b) {
  return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ)};
}
LAZYCCD_INLINE Mask operator<=(FloatLanes a, FloatLanes b) {
  return {_mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ)};
}
LAZYCCD_INLINE FloatLanes select(Mask m, FloatLanes a, FloatLanes b) {
  return _mm512_mask_blend_ps(m.m, b.v, a.v);
}
LAZYCCD_INLINE FloatLanes lane_min(FloatLanes a, FloatLanes b) { return _mm512_min_ps(a.v, b.v); }
LAZYCCD_INLINE FloatLanes lane_max(FloatLanes a, FloatLanes b) { return _mm512_max_ps(a.v, b.v); }
LAZYCCD_INLINE FloatLanes lane_abs(FloatLanes a) { return _mm512_abs_ps(a.v); }
LAZYCCD_INLINE FloatLanes lane_sqrt(FloatLanes a) { return _mm512_sqrt_ps(a.v); }
LAZYCCD_INLINE FloatLanes lane_floor(FloatLanes a) {
  return _mm512_roundscale_ps(a.v, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
}
LAZYCCD_INLINE Mask equal(const std::int32_t* p, std::int32_t x) {
  return {_mm512_cmpeq_epi32_mask(_mm512_load_si512(p), _mm512_set1_epi32(x))};
}

#elif defined(__AVX2__)

struct Mask {
  __m256 m;
  LAZYCCD_INLINE unsigned bits() const { return static_cast<unsigned>(_mm256_movemask_ps(m)); }
};
LAZYCCD_INLINE Mask operator&(Mask a, Mask b) { return {_mm256_and_ps(a.m, b.m)}; }
LAZYCCD_INLINE Mask operator|(Mask a, Mask b) { return {_mm256_or_ps(a.m, b.m)}; }
LAZYCCD_INLINE Mask operator!(Mask a) {
  return {_mm256_xor_ps(a.m, _mm256_castsi256_ps(_mm256_set1_epi32(-1)))};
}

struct FloatLanes {
  static constexpr int lanes = 8;
  __m256 v;
  FloatLanes() = default;
  LAZYCCD_INLINE FloatLanes(__m256 x) : v(x) {}
  LAZYCCD_INLINE explicit FloatLanes(float x) : v(_mm256_set1_ps(x)) {}
  static LAZYCCD_INLINE FloatLanes load(const float* p) { return _mm256_load_ps(p); }
  LAZYCCD_INLINE void store(float* p) const { _mm256_store_ps(p, v); }
};
LAZYCCD_INLINE FloatLanes operator-(FloatLanes a) {
  return _mm256_xor_ps(a.v, _mm256_set1_ps(-0.0f));
}
LAZYCCD_INLINE Mask operator<(FloatLanes a, FloatLanes b) {
  return {_mm256_cmp_ps(a.v, b.v, _CMP_LT_OQ)};
}
LAZYCCD_INLINE Mask operator<=(FloatLanes a, FloatLanes b) {
  return {_mm256_cmp_ps(a.v, b.v, _CMP_LE_OQ)};
}
LAZYCCD_INLINE FloatLanes select(Mask m, FloatLanes a, FloatLanes b) {
  return _mm256_blendv_ps(b.v, a.v, m.m);
}
LAZYCCD_INLINE FloatLanes lane_min(FloatLanes a, FloatLanes b) { return _mm256_min_ps(a.v, b.v); }
LAZYCCD_INLINE FloatLanes lane_max(FloatLanes a, FloatLanes b) { return _mm256_max_ps(a.v, b.v); }
LAZYCCD_INLINE FloatLanes lane_abs(FloatLanes a) {
  return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.v);
}
LAZYCCD_INLINE FloatLanes lane_sqrt(FloatLanes a) { return _mm256_sqrt_ps(a.v); }
LAZYCCD_INLINE FloatLanes lane_floor(FloatLanes a) { return _mm256_floor_ps(a.v); }
LAZYCCD_INLINE Mask equal(const std::int32_t* p, std::int32_t x) {
  const __m256i row = _mm256_load_si256(reinterpret_cast<const __m256i*>(p));
  return {_mm256_castsi256_ps(_mm256_cmpeq_epi32(row, _mm256_set1_epi32(x)))};
}

#else  // four lanes: SSE2, NEON and others

using Float4 = SimdVector<float, 4>;
using Int4 = SimdVector<std::int32_t, 4>;

struct Mask {
  Int4 m;
  LAZYCCD_INLINE unsigned bits() const {
#if defined(LAZYCCD_PLAIN_CPP)
    return (m[0] & 1u) | (m[1] & 2u) | (m[2] & 4u) | (m[3] & 8u);
#elif defined(__SSE2__)
    return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(m)));
#elif defined(__aarch64__)
    return vaddvq_u32(reinterpret_cast<uint32x4_t>(m & Int4{1, 2, 4, 8}));
#elif defined(__wasm_simd128__)
    return wasm_i32x4_bitmask(reinterpret_cast<v128_t>(m));
#else
    return (m[0] & 1u) | (m[1] & 2u) | (m[2] & 4u) | (m[3] & 8u);
#endif
  }
};
LAZYCCD_INLINE Mask operator&(Mask a, Mask b) { return {a.m & b.m}; }
LAZYCCD_INLINE Mask operator|(Mask a, Mask b) { return {a.m | b.m}; }
LAZYCCD_INLINE Mask operator!(Mask a) { return {~a.m}; }

struct FloatLanes {
  static constexpr int lanes = 4;
  Float4 v;
  FloatLanes() = default;
  LAZYCCD_INLINE FloatLanes(Float4 x) : v(x) {}
  LAZYCCD_INLINE explicit FloatLanes(float x) : v{x, x, x, x} {}
  static LAZYCCD_INLINE FloatLanes load(const float* p) {
    return *reinterpret_cast<const Float4*>(p);
  }
  LAZYCCD_INLINE void store(float* p) const { *reinterpret_cast<Float4*>(p) = v; }
};
LAZYCCD_INLINE FloatLanes operator-(FloatLanes a) { return -a.v; }
LAZYCCD_INLINE Mask operator<(FloatLanes a, FloatLanes b) { return {a.v < b.v}; }
LAZYCCD_INLINE Mask operator<=(FloatLanes a, FloatLanes b) { return {a.v <= b.v}; }
LAZYCCD_INLINE FloatLanes select(Mask m, FloatLanes a, FloatLanes b) {
  return bit_cast<Float4>((m.m & bit_cast<Int4>(a.v)) | (~m.m & bit_cast<Int4>(b.v)));
}
LAZYCCD_INLINE FloatLanes lane_min(FloatLanes a, FloatLanes b) { return select(a < b, a, b); }
LAZYCCD_INLINE FloatLanes lane_max(FloatLanes a, FloatLanes b) { return select({b.v < a.v}, a, b); }
LAZYCCD_INLINE FloatLanes lane_abs(FloatLanes a) {
  return bit_cast<Float4>(bit_cast<Int4>(a.v) & INT32_MAX);
}
#if defined(__aarch64__) && !defined(LAZYCCD_PLAIN_CPP)
LAZYCCD_INLINE FloatLanes lane_sqrt(FloatLanes a) {
  return reinterpret_cast<Float4>(vsqrtq_f32(reinterpret_cast<float32x4_t>(a.v)));
}
LAZYCCD_INLINE FloatLanes lane_floor(FloatLanes a) {
  return reinterpret_cast<Float4>(vrndmq_f32(reinterpret_cast<float32x4_t>(a.v)));
}
#elif defined(__wasm_simd128__) && !defined(LAZYCCD_PLAIN_CPP)
LAZYCCD_INLINE FloatLanes lane_sqrt(FloatLanes a) {
  return reinterpret_cast<Float4>(wasm_f32x4_sqrt(reinterpret_cast<v128_t>(a.v)));
}
LAZYCCD_INLINE FloatLanes lane_floor(FloatLanes a) {
  return reinterpret_cast<Float4>(wasm_f32x4_floor(reinterpret_cast<v128_t>(a.v)));
}
#else
LAZYCCD_INLINE FloatLanes lane_sqrt(FloatLanes a) { return square_root(a.v); }
LAZYCCD_INLINE FloatLanes lane_floor(FloatLanes a) {
  for (int i = 0; i < 4; ++i) a.v[i] = ::floorf(a.v[i]);
  return a;
}
#endif
LAZYCCD_INLINE Mask equal(const std::int32_t* p, std::int32_t x) {
  return {*reinterpret_cast<const Int4*>(p) == x};
}

#endif

LAZYCCD_INLINE FloatLanes operator+(FloatLanes a, FloatLanes b) { return a.v + b.v; }
LAZYCCD_INLINE FloatLanes operator-(FloatLanes a, FloatLanes b) { return a.v - b.v; }
LAZYCCD_INLINE FloatLanes operator*(FloatLanes a, FloatLanes b) { return a.v * b.v; }
LAZYCCD_INLINE FloatLanes operator/(FloatLanes a, FloatLanes b) { return a.v / b.v; }
LAZYCCD_INLINE Mask operator>(FloatLanes a, FloatLanes b) { return b < a; }
LAZYCCD_INLINE Mask operator>=(FloatLanes a, FloatLanes b) { return b <= a; }
// Stores the chosen lanes one after the other, from p on. Writes up to a whole pack.
LAZYCCD_INLINE void store_chosen(FloatLanes a, unsigned chosen, float* p) {
#if defined(__AVX512F__)
  _mm512_storeu_ps(p, _mm512_maskz_compress_ps(static_cast<__mmask16>(chosen), a.v));
#else
  alignas(64) float lanes[FloatLanes::lanes];
  a.store(lanes);
  for (int i = 0; i < FloatLanes::lanes; ++i) {
    *p = lanes[i];
    p += chosen >> i & 1;
  }
#endif
}
LAZYCCD_INLINE bool lane_any(Mask m) { return m.bits() != 0; }

}  // namespace LAZYCCD_ISA

template <>
struct Lane<LAZYCCD_ISA::FloatLanes> {
  using Mask = LAZYCCD_ISA::Mask;
  using Scalar = float;
};

}  // namespace lazyccd
