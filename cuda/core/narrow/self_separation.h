// The minimum separation of one pair of primitives: within a body it may be smaller than between
// bodies (Topology::self_separation).
#pragma once

#include <cmath>
#include <cstdint>

#include "core/narrow/contact_math.h"

namespace lazyccd {

/// The largest and the smallest Topology::self_separation of the vertices of primitive a, then of
/// primitive b; unscaled.
struct SelfLimits {
  float largest[2], smallest[2];
};

/// Returns the limits of a pair; infinite if its primitives belong to two bodies. `of_vertex`: by
/// vertex, not null.
template <ContactKind kind>
LAZYCCD_HD inline SelfLimits self_limits(const MeshView& mesh, const float* of_vertex,
                                         Candidate pair) {
  constexpr bool vf = kind == ContactKind::vertex_face;
  const std::int32_t* const a = vf ? &pair.a : mesh.edges[pair.a];
  const std::int32_t* const b = vf ? mesh.faces[pair.b] : mesh.edges[pair.b];
  constexpr float infinite = HUGE_VALF;
  if (mesh.body_of_vertex[a[0]] != mesh.body_of_vertex[b[0]])
    return {{infinite, infinite}, {infinite, infinite}};
  const float a0 = of_vertex[a[0]], a1 = of_vertex[a[vf ? 0 : 1]];
  const float b0 = of_vertex[b[0]], b1 = of_vertex[b[1]], b2 = of_vertex[b[vf ? 2 : 1]];
  const auto larger = [](float x, float y) { return x > y ? x : y; };
  const auto smaller = [](float x, float y) { return x < y ? x : y; };
  return {{larger(a0, a1), larger(larger(b0, b1), b2)},
          {smaller(a0, a1), smaller(smaller(b0, b1), b2)}};
}

/// The separations of a scene, unscaled.
struct Separations {
  double between_bodies;     // DetectorOptions::separation
  const float* within_body;  // by vertex, as Topology::self_separation; null: no limit

  /// No pair has less than this, because the search for a much smaller distance takes many steps.
  LAZYCCD_HD double least() const { return 0x1p-10 * between_bodies; }

  /// Returns by how much `separation` is smaller than that between bodies: times `scale`, a power
  /// of two, and rounded down.
  LAZYCCD_HD float saving(double separation, double scale) const {
    const double less = (between_bodies - separation) * scale;
    return static_cast<float>(less < 0x1p100 ? less : 0x1p100) * (1 - 0x1p-20f);
  }

  /// Returns the separation of two primitives of one body, from the limits of both.
  LAZYCCD_HD double within(float a, float b) const {
    const double limit = a < b ? a : b;
    return limit < least() ? least() : limit < between_bodies ? limit : between_bodies;
  }

  /// Returns the separation of a pair.
  template <ContactKind kind>
  LAZYCCD_HD double of(const MeshView& mesh, Candidate pair) const {
    if (within_body == nullptr) return between_bodies;
    const SelfLimits limits = self_limits<kind>(mesh, within_body, pair);
    return within(limits.largest[0], limits.largest[1]);
  }
};

}  // namespace lazyccd
