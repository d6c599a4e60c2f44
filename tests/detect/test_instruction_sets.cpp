// The leaf's kernels of each instruction set that this machine has.
#include <random>

#include "cpu/cpu_detector.h"
#include "support/catch.h"
#include "support/moving_triangles.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

MovingTriangles crowd(int count) {
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

}  // namespace

TEST_CASE("every instruction set finds the same contacts") {
  const MovingTriangles scene = crowd(1500);
  const Mesh mesh(scene.topology());
  for (const double separation : {0.0, 0.002, 0.05}) {
    Options options;
    options.threads = 1;
    options.separation = separation;
    const auto hash = [&](const LeafKernels& kernels) {
      CpuDetector detector(options, kernels);
      detector.set_mesh(mesh);
      Stats stats;
      CHECK(detector.detect(scene.at(scene.start), scene.at(scene.end), stats).size() > 1000);
      return stats.hash;
    };
    const std::uint64_t expected = hash(*leaf_kernels("baseline"));
    for (const char* name : {"avx2", "avx512"}) {
      if (const LeafKernels* kernels = leaf_kernels(name)) CHECK(hash(*kernels) == expected);
    }
  }
}
