// LazyCCD without Bullet: finds the contact of two triangles, one of which falls through the other
// within one step.
//
// With CMake: find_package(LazyCCD REQUIRED), then link LazyCCD::core. By hand, after
// `cmake --install build`:
//
//   g++ -std=c++17 detector.cpp -llazyccd_core -lpthread
#include <lazyccd/detector.h>
#include <lazyccd/error.h>

#include <cstdio>
#include <vector>

int main() {
  // Two bodies of one triangle each. Body 0 lies in the plane y = 0. Body 1 stands above it; its
  // lowest corner is at y = 0.1 m.
  const std::vector<lazyccd::Face> faces = {{0, 1, 2}, {3, 4, 5}};
  const std::vector<int> body_of_vertex = {0, 0, 0, 1, 1, 1};
  lazyccd::Topology topology;
  topology.vertex_count = 6;
  topology.faces = faces;
  topology.body_of_vertex = body_of_vertex;

  const std::vector<float> start = {
      -1, 0,    -1, 1,    0,    -1, 0, 0,    1,    // body 0
      0,  0.1f, 0,  0.2f, 0.5f, 0,  0, 0.5f, 0.2f  // body 1
  };
  // In this step body 1 falls by 0.4 m and body 0 stays. Every vertex moves along a straight line.
  std::vector<float> end = start;
  for (int vertex = 3; vertex < 6; ++vertex) end[3 * vertex + 1] -= 0.4f;

  try {
    lazyccd::Detector detector;
    detector.set_topology(topology);  // once, and again after every change of the mesh
    // In every step:
    for (const lazyccd::Contact& c : detector.detect({start.data(), 6}, {end.data(), 6})) {
      const char* kind = c.kind == lazyccd::ContactKind::vertex_face ? "vertex-face" : "edge-edge";
      std::printf(
          "%s: vertices %d %d %d %d of bodies %d and %d, at %.9f of the step, normal %g %g %g\n",
          kind, c.vertices[0], c.vertices[1], c.vertices[2], c.vertices[3], c.body_a, c.body_b,
          c.toi, c.normal[0], c.normal[1], c.normal[2]);
    }
    std::printf("backend: %s\n", detector.status().c_str());
  } catch (const lazyccd::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
