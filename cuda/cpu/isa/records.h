// Access to the vertex records of a candidate. A record is read as one vector.
#pragma once

#include "cpu/isa/float_lanes.h"
#include "host/kernels/leaf_kernels.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

// The eight doubles of a record.
using Double8 = SimdVector<double, 8>;

// Half of a record: a position and the number after it.
using Double4 = SimdVector<double, 4>;

LAZYCCD_INLINE const Double8* records_of(const LeafScene& scene) {
  return reinterpret_cast<const Double8*>(scene.records);
}

// The vertices between which the differences of a candidate are taken: see
// core/narrow/elementary.h.
struct Ends {
  std::int32_t e1[2], e2[2], r[2];  // from, to
};

template <ContactKind kind>
LAZYCCD_INLINE Ends ends(const LeafScene& scene, Candidate c) {
  if constexpr (kind == ContactKind::vertex_face) {
    const std::int32_t* f = scene.mesh.faces[c.b];
    return {{f[0], f[1]}, {f[0], f[2]}, {f[0], c.a}};
  } else {
    const std::int32_t *a = scene.mesh.edges[c.a], *b = scene.mesh.edges[c.b];
    return {{a[0], a[1]}, {b[0], b[1]}, {a[0], b[0]}};
  }
}

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
