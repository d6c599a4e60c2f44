// Rows of floats, one a lane, turned into packs, one a column.
#pragma once

#include "core/vec.h"
#include "cpu/isa/pack.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

typedef float Float8 __attribute__((vector_size(32), aligned(32)));

constexpr int kColumns = 6;  // of the eight of a row

#if defined(__AVX512F__)

LAZYCCD_INLINE void transpose(const Float8 (&rows)[Pack::lanes], Pack (&columns)[kColumns]) {
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

LAZYCCD_INLINE void transpose(const Float8 (&rows)[Pack::lanes], Pack (&columns)[kColumns]) {
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

LAZYCCD_INLINE void transpose(const Float8 (&rows)[Pack::lanes], Pack (&columns)[kColumns]) {
  for (int k = 0; k < kColumns; ++k) {
    alignas(16) float lanes[Pack::lanes];
    for (int i = 0; i < Pack::lanes; ++i) lanes[i] = rows[i][k];
    columns[k] = Pack::load(lanes);
  }
}

#endif

typedef float Float4Row __attribute__((vector_size(16), aligned(16)));

// Where the row of a lane has to stand for columns_of(): each quarter of a register is transposed
// by itself.
constexpr int row_of_lane(int lane) { return lane % 4 * (Pack::lanes / 4) + lane / 4; }

// The first three columns of rows of four.
#if defined(__AVX512F__)

LAZYCCD_INLINE Vec3<Pack> columns_of(const Float4Row (&rows)[Pack::lanes]) {
  const float* p = reinterpret_cast<const float*>(rows);
  const __m512 a = _mm512_load_ps(p), b = _mm512_load_ps(p + 16), c = _mm512_load_ps(p + 32),
               d = _mm512_load_ps(p + 48);
  const __m512 ab = _mm512_unpacklo_ps(a, b), cd = _mm512_unpacklo_ps(c, d);
  return {Pack(_mm512_shuffle_ps(ab, cd, 0x44)), Pack(_mm512_shuffle_ps(ab, cd, 0xee)),
          Pack(_mm512_shuffle_ps(_mm512_unpackhi_ps(a, b), _mm512_unpackhi_ps(c, d), 0x44))};
}

#elif defined(__AVX2__)

LAZYCCD_INLINE Vec3<Pack> columns_of(const Float4Row (&rows)[Pack::lanes]) {
  const float* p = reinterpret_cast<const float*>(rows);
  const __m256 a = _mm256_load_ps(p), b = _mm256_load_ps(p + 8), c = _mm256_load_ps(p + 16),
               d = _mm256_load_ps(p + 24);
  const __m256 ab = _mm256_unpacklo_ps(a, b), cd = _mm256_unpacklo_ps(c, d);
  return {Pack(_mm256_shuffle_ps(ab, cd, 0x44)), Pack(_mm256_shuffle_ps(ab, cd, 0xee)),
          Pack(_mm256_shuffle_ps(_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d), 0x44))};
}

#else

LAZYCCD_INLINE Vec3<Pack> columns_of(const Float4Row (&rows)[Pack::lanes]) {
  const auto column = [&](int k) {
    return Pack(Float4{rows[0][k], rows[1][k], rows[2][k], rows[3][k]});
  };
  return {column(0), column(1), column(2)};
}

#endif

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
