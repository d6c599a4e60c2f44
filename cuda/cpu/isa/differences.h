// Differences of positions in single precision, a lane a candidate.
#pragma once

#include "core/elementary.h"
#include "cpu/isa/records.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

// The difference of two records is scaled in double, so that only the rounding to float of the
// result is coarse (core/elementary.h).
typedef float Float8 __attribute__((vector_size(32), aligned(32)));

// Rows of floats, a candidate each, turned into packs, a component each.
struct alignas(64) Rows {
  Float8 row[3][Pack::lanes];

  LAZYCCD_INLINE Pack component(int difference, int index) const {
    alignas(64) float lanes[Pack::lanes];
    for (int i = 0; i < Pack::lanes; ++i) lanes[i] = row[difference][i][index];
    return Pack::load(lanes);
  }
  LAZYCCD_INLINE Vec3<Pack> vector(int difference, int end) const {
    return {component(difference, 3 * end), component(difference, 3 * end + 1),
            component(difference, 3 * end + 2)};
  }
};

template <ContactKind kind>
LAZYCCD_INLINE Rows difference_rows(const LeafScene& scene, const Candidate* c) {
  Rows rows;
  const Double8* records = records_of(scene);
  for (int i = 0; i < Pack::lanes; ++i) {
    const Ends e = ends<kind>(scene, c[i]);
    const auto difference = [&](const std::int32_t(&p)[2]) {
      return __builtin_convertvector((records[p[1]] - records[p[0]]) * scene.scale, Float8);
    };
    rows.row[0][i] = difference(e.e1);
    rows.row[1][i] = difference(e.e2);
    rows.row[2][i] = difference(e.r);
  }
  return rows;
}

template <ContactKind kind>
LAZYCCD_INLINE Differences<Pack> gather(const LeafScene& scene, const Candidate* c) {
  const Rows rows = difference_rows<kind>(scene, c);
  Differences<Pack> d;
  for (int end = 0; end < 2; ++end) {
    d.e1[end] = rows.vector(0, end);
    d.e2[end] = rows.vector(1, end);
    d.r[end] = rows.vector(2, end);
  }
  return d;
}

// The same where the step begins.
template <ContactKind kind>
LAZYCCD_INLINE void gather_start(const LeafScene& scene, const Candidate* c, Vec3<Pack>& e1,
                                 Vec3<Pack>& e2, Vec3<Pack>& r) {
  const Rows rows = difference_rows<kind>(scene, c);
  e1 = rows.vector(0, 0);
  e2 = rows.vector(1, 0);
  r = rows.vector(2, 0);
}

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
