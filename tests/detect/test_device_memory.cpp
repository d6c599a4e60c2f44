// Detection in device memory where there is no device. What it finds is checked on a GPU, by
// tests/gpu.
#include <vector>

#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "support/catch.h"

using namespace lazyccd;

TEST_CASE("detection in device memory without the GPU says that there is none") {
  DetectorOptions options;
  options.backend = Backend::cpu;
  Detector detector(options);
  const std::vector<float> x(9, 0.0f);
  const DevicePositions positions(x.data(), 3);
  const auto code_of = [](auto&& call) {
    try {
      call();
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::file;
  };
  CHECK(code_of([&] { detector.detect_async(positions, positions, nullptr); }) ==
        ErrorCode::unavailable);
  CHECK(code_of([&] { detector.synchronize(); }) == ErrorCode::unavailable);
  CHECK(code_of([&] { detector.download_contacts(); }) == ErrorCode::unavailable);
  // The host's detection is as before.
  Topology topology;
  topology.vertex_count = 3;
  const std::vector<Face> faces{{0, 1, 2}};
  topology.faces = faces;
  detector.set_topology(topology);
  CHECK(detector.detect({x.data(), 3}, {x.data(), 3}).empty());
}
