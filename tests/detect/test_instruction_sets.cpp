// The leaf's kernels of each instruction set that this machine has.
#include "cpu/cpu_detector.h"
#include "support/catch.h"
#include "support/moving_triangles.h"

using namespace lazyccd;
using namespace lazyccd::test;

TEST_CASE("every instruction set finds the same contacts") {
  const MovingTriangles scene = crowd_of_triangles(1500);
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
