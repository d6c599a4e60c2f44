#include <lazyccd/detector.h>

#include <cstdio>
#include <vector>

int main() {
  // A vertex of the upper triangle falls through the lower one.
  const std::vector<double> start = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, 0.1, 2, 2, 3, 2, 3, 3};
  std::vector<double> end = start;
  end[11] = -0.1;
  const std::vector<lazyccd::Face> faces = {{0, 1, 2}, {3, 4, 5}};
  lazyccd::Topology topology;
  topology.vertex_count = 6;
  topology.faces = faces;

  lazyccd::Detector detector;
  detector.set_topology(topology);
  const auto contacts = detector.detect({start.data(), 6}, {end.data(), 6});
  std::printf("%zu contacts\n", contacts.size());
  return contacts.size() == 1 && contacts[0].toi == 0.5 ? 0 : 1;
}
