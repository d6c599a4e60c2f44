// Triangles at both ends of a step, as tests make them.
#pragma once

#include <random>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::test {

struct MovingTriangles {
  std::vector<double> start, end;  // three coordinates a vertex
  std::vector<Face> faces;

  Topology topology() const {
    Topology t;
    t.vertex_count = start.size() / 3;
    t.faces = faces;
    return t;
  }
  static Positions at(const std::vector<double>& x) { return {x.data(), x.size() / 3}; }
};

// Of size 0.1 in a cube of size 2; each flies its own way and turns a little.
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

}  // namespace lazyccd::test
