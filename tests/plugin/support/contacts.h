// Contacts for tests of what is made of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/pair_surfaces.h"
#include "lazyccd/contact.h"

namespace lazyccd::test {

// The same thickness (metres) and friction between all of `bodies` bodies.
inline bullet::PairSurfaces uniform_surfaces(double thickness, double friction,
                                             std::size_t bodies = 8) {
  bullet::SolverOptions options;
  options.thickness = thickness;
  bullet::PairSurfaces surfaces(options, [](double a, double) { return a; });
  surfaces.update(std::vector<bullet::BodySurface>(bodies, {0, friction, true}), 0);
  return surfaces;
}

// With the normal upwards.
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
