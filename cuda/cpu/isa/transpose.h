// Transposes rows, one per lane, into packs, one per column.
#pragma once

#include "core/vec.h"
#include "cpu/isa/double_lanes.h"
#include "cpu/isa/float_lanes.h"
#include "cpu/isa/records.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

using Float8 = SimdVector<float, 8>;

constexpr int kColumns = 6;  // columns used, of the eight of a row

#if defined(__AVX512F__)

LAZYCCD_INLINE void transpose(const Float8 (&rows)[FloatLanes::lanes],
                              FloatLanes (&columns)[kColumns]) {
  // Rows i and i + 8 side by side; then 4 x 4 within each quarter of a register.
  __m512 pairs[8], mixed[8], quads[8];
  for (int i = 0; i < 8; ++i) {
    const __m512 low = _mm512_castps256_ps512(reinterpret_cast<const __m256&>(rows[i]));
    pairs[i] = _mm512_insertf32x8(low, reinterpret_cast<const __m256&>(rows[i + 8]), 1);
  }
  for (int i = 0; i < 8; i += 2) {
    mixed[i] = _mm512_unpacklo_ps(pairs[i], pairs[i + 1]);
    mixed[i + 1] = _mm512_unpackhi_ps(pairs[i], pairs[i + 1]);
  }
  for (int i = 0; i < 8; i += 4) {
    for (int k = 0; k < 2; ++k) {
      const __m512d a = _mm512_castps_pd(mixed[i + k]), b = _mm512_castps_pd(mixed[i + k + 2]);
      quads[i + 2 * k] = _mm512_castpd_ps(_mm512_unpacklo_pd(a, b));
      quads[i + 2 * k + 1] = _mm512_castpd_ps(_mm512_unpackhi_pd(a, b));
    }
  }
  const __m512i low = _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13);
  const __m512i high = _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15);
  for (int k = 0; k < kColumns; ++k) {
    const __m512d a = _mm512_castps_pd(quads[k % 4]), b = _mm512_castps_pd(quads[4 + k % 4]);
    columns[k] = _mm512_castpd_ps(_mm512_permutex2var_pd(a, k < 4 ? low : high, b));
  }
}

#elif defined(__AVX2__)

LAZYCCD_INLINE void transpose(const Float8 (&rows)[FloatLanes::lanes],
                              FloatLanes (&columns)[kColumns]) {
  __m256 mixed[8], quads[8];
  for (int i = 0; i < 8; i += 2) {
    const __m256 a = reinterpret_cast<const __m256&>(rows[i]);
    const __m256 b = reinterpret_cast<const __m256&>(rows[i + 1]);
    mixed[i] = _mm256_unpacklo_ps(a, b);
    mixed[i + 1] = _mm256_unpackhi_ps(a, b);
  }
  for (int i = 0; i < 8; i += 4) {
    for (int k = 0; k < 2; ++k) {
      const __m256d a = _mm256_castps_pd(mixed[i + k]), b = _mm256_castps_pd(mixed[i + k + 2]);
      quads[i + 2 * k] = _mm256_castpd_ps(_mm256_unpacklo_pd(a, b));
      quads[i + 2 * k + 1] = _mm256_castpd_ps(_mm256_unpackhi_pd(a, b));
    }
  }
  for (int k = 0; k < 4; ++k) columns[k] = _mm256_permute2f128_ps(quads[k], quads[4 + k], 0x20);
  for (int k = 4; k < kColumns; ++k)
    columns[k] = _mm256_permute2f128_ps(quads[k - 4], quads[k], 0x31);
}

#else

LAZYCCD_INLINE void transpose(const Float8 (&rows)[FloatLanes::lanes],
                              FloatLanes (&columns)[kColumns]) {
  for (int k = 0; k < kColumns; ++k) {
    alignas(16) float lanes[FloatLanes::lanes];
    for (int i = 0; i < FloatLanes::lanes; ++i) lanes[i] = rows[i][k];
    columns[k] = FloatLanes::load(lanes);
  }
}

#endif

// Transposes records of doubles.
#if defined(__AVX512F__)

LAZYCCD_INLINE void transpose(const Double8 (&rows)[DoubleLanes::lanes],
                              DoubleLanes (&columns)[kColumns]) {
  // 2 x 2 within each pair of rows, then the quarters of the registers.
  __m512d even[4], odd[4];  // columns 0 2 4 6 and 1 3 5 7, two rows at a time
  for (int i = 0; i < 4; ++i) {
    const __m512d a = reinterpret_cast<const __m512d&>(rows[2 * i]);
    const __m512d b = reinterpret_cast<const __m512d&>(rows[2 * i + 1]);
    even[i] = _mm512_unpacklo_pd(a, b);
    odd[i] = _mm512_unpackhi_pd(a, b);
  }
  for (int k = 0; k < 2; ++k) {
    const __m512d(&pairs)[4] = k == 0 ? even : odd;
    const __m512d a = _mm512_shuffle_f64x2(pairs[0], pairs[1], 0x88),  // columns 0 and 4
        b = _mm512_shuffle_f64x2(pairs[2], pairs[3], 0x88),
                  c = _mm512_shuffle_f64x2(pairs[0], pairs[1], 0xdd),  // columns 2 and 6
        e = _mm512_shuffle_f64x2(pairs[2], pairs[3], 0xdd);
    columns[k] = _mm512_shuffle_f64x2(a, b, 0x88);
    columns[k + 2] = _mm512_shuffle_f64x2(c, e, 0x88);
    columns[k + 4] = _mm512_shuffle_f64x2(a, b, 0xdd);
  }
}

#elif defined(__AVX2__)

LAZYCCD_INLINE void transpose(const Double8 (&rows)[DoubleLanes::lanes],
                              DoubleLanes (&columns)[kColumns]) {
  for (int half = 0; half < 2; ++half) {
    __m256d row[4];
    for (int i = 0; i < 4; ++i)
      row[i] = _mm256_load_pd(reinterpret_cast<const double*>(&rows[i]) + 4 * half);
    const __m256d a = _mm256_unpacklo_pd(row[0], row[1]), b = _mm256_unpackhi_pd(row[0], row[1]),
                  c = _mm256_unpacklo_pd(row[2], row[3]), d = _mm256_unpackhi_pd(row[2], row[3]);
    columns[4 * half] = _mm256_permute2f128_pd(a, c, 0x20);
    columns[4 * half + 1] = _mm256_permute2f128_pd(b, d, 0x20);
    if (half == 1) break;
    columns[2] = _mm256_permute2f128_pd(a, c, 0x31);
    columns[3] = _mm256_permute2f128_pd(b, d, 0x31);
  }
}

#else

LAZYCCD_INLINE void transpose(const Double8 (&rows)[DoubleLanes::lanes],
                              DoubleLanes (&columns)[kColumns]) {
  for (int k = 0; k < kColumns; ++k) columns[k] = Double2{rows[0][k], rows[1][k]};
}

#endif

// Differences of positions in the quarters of a register, four floats per lane: first `lane`, then
// lane + 4, and so on. position(lane, which) returns four doubles.
#if defined(__AVX2__)

template <class Position>
LAZYCCD_INLINE Float8 halves_of(const Position& position, int lane, double scale) {
  const auto both = [&](int which) {
    const auto low = position(lane, which), high = position(lane + 4, which);
    return shuffle<0, 1, 2, 3, 4, 5, 6, 7>(low, high);
  };
  return convert<Float8>((both(1) - both(0)) * scale);
}

#endif

#if defined(__AVX512F__)

typedef __m512 Quarters;

template <class Position>
LAZYCCD_INLINE Quarters quarters_of(const Position& position, int lane, double scale) {
  const Float8 low = halves_of(position, lane, scale), high = halves_of(position, lane + 8, scale);
  return _mm512_insertf32x8(_mm512_castps256_ps512(reinterpret_cast<const __m256&>(low)),
                            reinterpret_cast<const __m256&>(high), 1);
}

// Returns the first three columns of the results of quarters_of() for the lanes 0 to 3.
LAZYCCD_INLINE Vec3<FloatLanes> columns_of(const Quarters (&rows)[4]) {
  const __m512 ab = _mm512_unpacklo_ps(rows[0], rows[1]), cd = _mm512_unpacklo_ps(rows[2], rows[3]),
               ab_high = _mm512_unpackhi_ps(rows[0], rows[1]),
               cd_high = _mm512_unpackhi_ps(rows[2], rows[3]);
  return {FloatLanes(_mm512_shuffle_ps(ab, cd, 0x44)), FloatLanes(_mm512_shuffle_ps(ab, cd, 0xee)),
          FloatLanes(_mm512_shuffle_ps(ab_high, cd_high, 0x44))};
}

#elif defined(__AVX2__)

typedef __m256 Quarters;

template <class Position>
LAZYCCD_INLINE Quarters quarters_of(const Position& position, int lane, double scale) {
  const Float8 halves = halves_of(position, lane, scale);
  return reinterpret_cast<const __m256&>(halves);
}

LAZYCCD_INLINE Vec3<FloatLanes> columns_of(const Quarters (&rows)[4]) {
  const __m256 ab = _mm256_unpacklo_ps(rows[0], rows[1]), cd = _mm256_unpacklo_ps(rows[2], rows[3]),
               ab_high = _mm256_unpackhi_ps(rows[0], rows[1]),
               cd_high = _mm256_unpackhi_ps(rows[2], rows[3]);
  return {FloatLanes(_mm256_shuffle_ps(ab, cd, 0x44)), FloatLanes(_mm256_shuffle_ps(ab, cd, 0xee)),
          FloatLanes(_mm256_shuffle_ps(ab_high, cd_high, 0x44))};
}

#else

typedef Float4 Quarters;

template <class Position>
LAZYCCD_INLINE Quarters quarters_of(const Position& position, int lane, double scale) {
  return convert<Float4>((position(lane, 1) - position(lane, 0)) * scale);
}

LAZYCCD_INLINE Vec3<FloatLanes> columns_of(const Quarters (&rows)[4]) {
  const auto column = [&](int k) {
    return FloatLanes(Float4{rows[0][k], rows[1][k], rows[2][k], rows[3][k]});
  };
  return {column(0), column(1), column(2)};
}

#endif

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
