// Triangle meshes with their positions at the start and the end of a step, and scenes made of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::test {

/// Triangles in linear motion.
struct MovingTriangles {
  std::vector<double> start, end;  ///< three coordinates per vertex
  std::vector<Face> faces;

  Topology topology() const {
    Topology t;
    t.vertex_count = start.size() / 3;
    t.faces = faces;
    return t;
  }
  static Positions at(const std::vector<double>& x) { return {x.data(), x.size() / 3}; }
};

/// Triangles of size 0.1 in a cube of size 2. Each moves in its own direction and rotates slightly.
inline MovingTriangles crowd_of_triangles(int count) {
  std::mt19937 random(7);
  const auto symmetric = [&random] { return random() / 2147483648.0 - 1; };
  MovingTriangles t;
  for (int i = 0; i < count; ++i) {
    const double centre[3] = {symmetric(), symmetric(), symmetric()};
    const double motion[3] = {symmetric(), symmetric(), symmetric()};
    for (int corner = 0; corner < 3; ++corner) {
      for (int k = 0; k < 3; ++k) {
        const double x = centre[k] + 0.1 * symmetric();
        t.start.push_back(x);
        t.end.push_back(x + 0.2 * motion[k] + 0.05 * symmetric());
      }
    }
    t.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return t;
}

/// Sheets of `nodes` x `nodes` nodes at rest. Neighbouring nodes are 0.1 apart. The sheets lie
/// `gap` above each other, nearly node above node.
inline MovingTriangles layers(int count, int nodes, double gap) {
  std::mt19937 random(5);
  MovingTriangles t;
  for (int layer = 0; layer < count; ++layer) {
    const std::int32_t first = static_cast<std::int32_t>(t.start.size() / 3);
    for (int i = 0; i < nodes; ++i) {
      for (int j = 0; j < nodes; ++j) {
        const auto aside = [&] { return 0.002 * (random() / 4294967296.0); };
        t.start.insert(t.start.end(), {0.1 * i + aside(), layer * gap, 0.1 * j + aside()});
        if (i + 1 == nodes || j + 1 == nodes) continue;
        const std::int32_t v = first + i * nodes + j;
        t.faces.push_back({v, v + 1, v + nodes});
        t.faces.push_back({v + 1, v + nodes + 1, v + nodes});
      }
    }
  }
  t.end = t.start;
  return t;
}

/// The body of each vertex if every one of `sheets` sheets of equal size is a body.
inline std::vector<std::int32_t> body_of_each(const MovingTriangles& scene, std::size_t sheets) {
  std::vector<std::int32_t> bodies(scene.start.size() / 3);
  for (std::size_t v = 0; v < bodies.size(); ++v)
    bodies[v] = static_cast<std::int32_t>(sheets * v / bodies.size());
  return bodies;
}

/// Sheets of equal size as bodies, with a Topology::self_separation that differs between vertices:
/// up to 1.2 times `separation`.
struct SheetsAsBodies {
  std::vector<std::int32_t> body_of_vertex;
  std::vector<float> self_separation;

  SheetsAsBodies(const MovingTriangles& scene, std::size_t sheets, double separation)
      : body_of_vertex(body_of_each(scene, sheets)) {
    for (std::size_t v = 0; v < body_of_vertex.size(); ++v)
      self_separation.push_back(static_cast<float>(
          std::min(0.1 * separation * static_cast<double>(3 + v * 7 % 10), 1e38)));
  }
  /// The scene's topology with these arrays, which must outlive it.
  Topology topology(const MovingTriangles& scene) const {
    Topology t = scene.topology();
    t.body_of_vertex = body_of_vertex;
    t.self_separation = self_separation;
    return t;
  }
};

}  // namespace lazyccd::test
