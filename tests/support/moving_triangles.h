// Triangles at both ends of a step, as tests make them.
#pragma once

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

}  // namespace lazyccd::test
