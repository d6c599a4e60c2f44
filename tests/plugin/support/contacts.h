// Contacts and surfaces for tests of rows and solvers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/pair_surfaces.h"
#include "lazyccd/contact.h"

namespace lazyccd::test {

/// The same thickness (metres) and friction coefficient for all pairs of `bodies` bodies.
inline bullet::PairSurfaces uniform_surfaces(double thickness, double friction,
                                             std::size_t bodies = 8) {
  bullet::SolverOptions options;
  options.thickness = thickness;
  bullet::PairSurfaces surfaces(options, bullet::WorldKind::rigid);
  surfaces.update(std::vector<bullet::BodySurface>(bodies, {0, friction, true}));
  return surfaces;
}

/// A contact of body 0 with itself and with an upward normal.
inline Contact contact(ContactKind kind, const std::array<std::int32_t, 4>& vertices, float u,
                       float v) {
  Contact result{};
  result.kind = kind;
  result.vertices = vertices;
  result.u = u;
  result.v = v;
  result.normal = {0, 1, 0};
  return result;
}

}  // namespace lazyccd::test
