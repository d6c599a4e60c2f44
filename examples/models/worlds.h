// A scene of many worlds, for the checks and timings of the device.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::models {

// A random number in [-1, 1] for two indices.
inline double noise(std::uint32_t a, std::uint32_t b) {
  std::uint32_t x = a * 0x9e3779b9u ^ (b + 0x7f4a7c15u) * 0x85ebca6bu;
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  return (x ^ x >> 16) / 2147483648.0 - 1;
}

enum class Layout { one_place, side_by_side };

// Triangles of bodies. The topology refers to them.
struct BodyMesh {
  std::vector<Face> faces;
  std::vector<std::int32_t> body_of_vertex;
  std::vector<Body> bodies;

  Topology topology() const {
    Topology t;
    t.vertex_count = body_of_vertex.size();
    t.faces = faces;
    t.body_of_vertex = body_of_vertex;
    t.bodies = bodies;
    return t;
  }
};

// A mesh with positions at both ends of a step.
struct MovingMesh : BodyMesh {
  std::vector<float> at[2];

  Positions positions(int end) const { return {at[end].data(), at[end].size() / 3}; }
};

// Worlds of waving sheets one above the other, and a floor that is in every world.
struct WorldsScene : MovingMesh {
  // first: the number of the first world. Worlds with the same number are the same.
  WorldsScene(std::int32_t worlds, std::int32_t bodies_each, Layout layout,
              std::int32_t first = 0) {
    const int cells = static_cast<int>(std::ceil(std::sqrt(worlds)));
    const float wide = layout == Layout::one_place ? 2.0f : 2.0f * cells;
    add_body(-1);
    for (const auto& [x, z] : {std::pair{-1.0f, -1.0f}, {wide, -1.0f}, {-1.0f, wide}, {wide, wide}})
      for (auto& positions : at) positions.insert(positions.end(), {x, 0, z});
    body_of_vertex.assign(4, 0);
    faces = {{0, 2, 1}, {1, 2, 3}};
    for (std::int32_t w = 0; w < worlds; ++w)
      for (std::int32_t b = 0; b < bodies_each; ++b)
        add_sheet(first + w, b, layout == Layout::one_place ? w : 0,
                  layout == Layout::one_place ? 0.0 : 1.25 * (w % cells),
                  layout == Layout::one_place ? 0.0 : 1.25 * (w / cells));
  }

  void add_body(std::int32_t world) {
    bodies.emplace_back();
    bodies.back().world = world;
  }

  void add_sheet(std::int32_t seed, std::int32_t level, std::int32_t world, double x0, double z0) {
    constexpr int n = 9;  // quads along each side
    add_body(world);
    const auto body = static_cast<std::int32_t>(bodies.size()) - 1;
    const auto first = static_cast<std::int32_t>(body_of_vertex.size());
    const auto name = static_cast<std::uint32_t>(seed * 64 + level);
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) {
        const double wave = 0.012 * std::sin(0.7 * i + 0.5 * j + 3 * noise(name, 1));
        const double y = 0.01 + 0.03 * level + wave;
        const double down = 0.008 * noise(name, 2);
        for (int end = 0; end < 2; ++end)
          at[end].insert(at[end].end(), {static_cast<float>(x0 + 0.1 * i + 0.02 * noise(name, 3)),
                                         static_cast<float>(y + down * end),
                                         static_cast<float>(z0 + 0.1 * j + 0.02 * noise(name, 4))});
        body_of_vertex.push_back(body);
        const std::int32_t v = first + i * (n + 1) + j;
        if (i == n || j == n) continue;
        faces.push_back({v, v + 1, v + n + 1});
        faces.push_back({v + 1, v + n + 2, v + n + 1});
      }
  }
};

}  // namespace lazyccd::models
