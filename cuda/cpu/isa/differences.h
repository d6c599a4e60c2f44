// Differences of positions in single precision, one candidate per lane.
#pragma once

#include "core/narrow/start_distance.h"
#include "cpu/isa/records.h"
#include "cpu/isa/transpose.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

// Gathers the differences of a pack of candidates at both ends of the step. They are computed and
// scaled in double, so that only the rounding of the result to float is coarse
// (core/narrow/elementary.h).
template <ContactKind kind>
LAZYCCD_INLINE Differences<FloatLanes> gather(const LeafScene& scene, const Candidate* c) {
  alignas(64) Float8 rows[3][FloatLanes::lanes];
  const Double8* records = records_of(scene);
  for (int i = 0; i < FloatLanes::lanes; ++i) {
    const Ends e = ends<kind>(scene, c[i]);
    const auto difference = [&](const std::int32_t(&p)[2]) {
      return convert<Float8>((records[p[1]] - records[p[0]]) * scene.scale);
    };
    rows[0][i] = difference(e.e1);
    rows[1][i] = difference(e.e2);
    rows[2][i] = difference(e.r);
  }
  FloatLanes columns[3][kColumns];
  for (int k = 0; k < 3; ++k) transpose(rows[k], columns[k]);
  const auto vector = [&](int k, int end) -> Vec3<FloatLanes> {
    const FloatLanes* column = columns[k] + 3 * end;
    return {column[0], column[1], column[2]};
  };
  Differences<FloatLanes> d;
  for (int end = 0; end < 2; ++end) {
    d.e1[end] = vector(0, end);
    d.e2[end] = vector(1, end);
    d.r[end] = vector(2, end);
  }
  return d;
}

template <ContactKind kind, int end>
LAZYCCD_INLINE DifferencesAt<FloatLanes> gather_at(const LeafScene& scene, const Candidate* c) {
  Ends of[FloatLanes::lanes];
  for (int i = 0; i < FloatLanes::lanes; ++i) of[i] = ends<kind>(scene, c[i]);
  const auto difference = [&](std::int32_t(Ends::*points)[2]) {
    const auto position = [&](int lane, int which) {
      const auto vertex = static_cast<std::uint32_t>((of[lane].*points)[which]);
      return load_unaligned<double, 4>(scene.records + 8 * std::size_t{vertex} + 3 * end);
    };
    Quarters rows[4];
    for (int i = 0; i < 4; ++i) rows[i] = quarters_of(position, i, scene.scale);
    return columns_of(rows);
  };
  return {difference(&Ends::e1), difference(&Ends::e2), difference(&Ends::r)};
}

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
