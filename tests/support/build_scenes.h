// Scenes for the tests of how edges, groups and the tree are built. Header only: the checks of the
// GPU use it too.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::test {

/// A scene at rest, of one of many kinds.
struct BuildScene {
  std::string name;
  std::vector<double> x;
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<std::int32_t> body_of_vertex;
  std::vector<float> inverse_mass;
  std::vector<Body> bodies;

  Topology topology() const {
    Topology t;
    t.vertex_count = x.size() / 3;
    t.faces = faces;
    t.edges = edges;
    t.body_of_vertex = body_of_vertex;
    t.inverse_mass = inverse_mass;
    t.bodies = bodies;
    return t;
  }
  std::int32_t add_vertex(double a, double b, double c, std::int32_t body) {
    x.insert(x.end(), {a, b, c});
    body_of_vertex.push_back(body);
    return static_cast<std::int32_t>(body_of_vertex.size()) - 1;
  }
  // Adds a sheet of n x n quads.
  void add_sheet(int n, std::int32_t body, double size, double height) {
    const auto base = static_cast<std::int32_t>(body_of_vertex.size());
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        add_vertex(size * i / n, size * j / n, height + 0.01 * ((i * 7 + j * 3) % 5), body);
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const std::int32_t v = base + j * (n + 1) + i;
        faces.push_back({v, v + 1, v + n + 1});
        faces.push_back({v + n + 2, v + n + 1, v + 1});
      }
  }
  void shuffle_faces() {
    std::mt19937 random(3);
    for (std::size_t i = faces.size(); i-- > 1;) std::swap(faces[i], faces[random() % (i + 1)]);
  }
};

/// Ordinary scenes, and degenerate ones.
inline std::vector<BuildScene> build_scenes() {
  std::vector<BuildScene> all;
  const auto add = [&](const std::string& name) -> BuildScene& {
    all.emplace_back();
    all.back().name = name;
    return all.back();
  };
  {
    BuildScene& s = add("a large sheet in random order");
    s.add_sheet(150, 0, 1, 0);
    s.shuffle_faces();
  }
  {
    BuildScene& s = add("a small sheet far from one large face");
    s.add_sheet(130, 0, 1, 0);
    const std::int32_t a = s.add_vertex(0, 0, -9, 0), b = s.add_vertex(1e7, 0, -9, 0),
                       c = s.add_vertex(0, 1e7, -9, 0);
    s.faces.push_back({a, b, c});
  }
  {
    BuildScene& s = add("all centroids equal");
    for (int i = 0; i < 5000; ++i) {
      const std::int32_t a = s.add_vertex(-1, -1, 0, 0), b = s.add_vertex(1, 0, 0, 0),
                         c = s.add_vertex(0, 1, 0, 0);
      s.faces.push_back({a, b, c});
    }
  }
  {
    BuildScene& s = add("one face");
    s.add_vertex(0, 0, 0, 0), s.add_vertex(1, 0, 0, 0), s.add_vertex(0, 1, 0, 0);
    s.faces.push_back({2, 0, 1});
  }
  {
    BuildScene& s = add("free edges only");
    for (int i = 0; i < 3000; ++i) s.add_vertex(0.1 * i, i % 7, i % 11, 0);
    for (int i = 0; i + 1 < 3000; ++i) s.edges.push_back({i + 1, i});
    s.edges.push_back({0, 1});  // named twice
  }
  {
    BuildScene& s = add("many bodies of one face");
    for (int i = 0; i < 9000; ++i) {
      const int body = (i * 4177) % 9000;
      const std::int32_t a = s.add_vertex(i % 21, i % 20, i % 22, body),
                         b = s.add_vertex(i % 21 + 1, i % 20, i % 22, body),
                         c = s.add_vertex(i % 21, i % 20 + 1, i % 22, body);
      s.faces.push_back({a, b, c});
    }
  }
  {
    BuildScene& s = add("bodies of faces and free edges, mixed, some pinned");
    for (int body = 0; body < 5; ++body) s.add_sheet(40, body, 1, 0.1 * body);
    s.add_sheet(140, 5, 2, 0);
    s.shuffle_faces();
    const std::int32_t first = s.add_vertex(0, 0, 0, 2);
    for (int i = 0; i < 50; ++i) s.edges.push_back({s.add_vertex(0, i, 0, 2), first});
    s.edges.push_back({1, 0});   // a side of a face
    s.edges.push_back({0, 90});  // no side
    std::mt19937 random(5);
    for (std::size_t v = 0; v < s.body_of_vertex.size(); ++v)
      s.inverse_mass.push_back(s.body_of_vertex[v] == 1 || random() % 10 < 3 ? 0.0f : 1.0f);
  }
  {
    BuildScene& s = add("a fan, and faces that share an edge");
    const std::int32_t a = s.add_vertex(0, 0, 0, 0), b = s.add_vertex(0, 0, 1, 0);
    std::int32_t last = s.add_vertex(1, 0, 0, 0);
    s.faces.push_back({a, b, last});
    for (int i = 1; i < 3000; ++i) {
      const std::int32_t v = s.add_vertex(1, i, 0, 0);
      s.faces.push_back({v, a, b});
      s.faces.push_back({last, v, a});
      last = v;
    }
  }
  {
    BuildScene& s = add("worlds at one place, of many sizes and in random order");
    const int worlds = 60;
    for (int body = 0; body < 4 * worlds; ++body) {
      s.bodies.emplace_back();
      s.bodies.back().world = body % 7 == 3 ? -1 : body * 37 % worlds;
      s.add_sheet(body == 100 ? 130 : 1 + body % 9, body, 1, 0.001 * body);
    }
    s.shuffle_faces();
  }
  return all;
}

}  // namespace lazyccd::test
