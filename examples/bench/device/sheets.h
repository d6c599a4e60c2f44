// The sheets of the benches of the GPU.
#pragma once

#include <cmath>
#include <cstdint>

#include "models/worlds.h"

namespace lazyccd::bench {

/// Two sheets of n x n quads, one above the other, that wave and touch in stripes.
inline models::MovingMesh two_sheets(int n) {
  models::MovingMesh s;
  s.bodies.resize(2);
  const double cell = 1.0 / n;
  for (std::int32_t body = 0; body < 2; ++body) {
    const auto first = static_cast<std::int32_t>(s.body_of_vertex.size());
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i) {
        // Irregular, so that hardly any query is a special case.
        const auto name = static_cast<std::uint32_t>(s.body_of_vertex.size());
        const auto aside = [&](std::uint32_t axis) {
          return 0.15 * cell * models::noise(name, axis);
        };
        const double x = cell * i + aside(0), z = cell * j + aside(1);
        const double y = 0.02 * body + 0.02 * std::sin(9 * x + body) * std::cos(7 * z) + aside(2);
        for (int end = 0; end < 2; ++end)
          s.at[end].insert(s.at[end].end(),
                           {static_cast<float>(x), static_cast<float>(y - 0.3 * cell * body * end),
                            static_cast<float>(z)});
        s.body_of_vertex.push_back(body);
        if (i == n || j == n) continue;
        const std::int32_t v = first + j * (n + 1) + i;
        s.faces.push_back({v, v + 1, v + n + 1});
        s.faces.push_back({v + n + 2, v + n + 1, v + 1});
      }
  }
  return s;
}

}  // namespace lazyccd::bench
