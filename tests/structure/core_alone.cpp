// A program that links LazyCCD::core alone. The test looks for symbols of LazyCCD::research in it.
// It checks that the core refuses by name what only that library has. Exit code: 0 passed.
#include <cstdio>
#include <string>

#include "lazyccd/detector.h"
#include "lazyccd/error.h"

using namespace lazyccd;

namespace {

int failures = 0;

// Expects that the options are refused with a message that has `name` in it.
void expect_refusal(const AlgorithmOptions& algorithm, const std::string& name) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.algorithm = algorithm;
  try {
    const Detector detector(options);
    std::printf("FAIL %s is not refused\n", name.c_str());
  } catch (const Error& error) {
    const std::string what = error.what();
    if (error.code() == ErrorCode::unavailable && what.find(name) != std::string::npos &&
        what.find("LazyCCD::research") != std::string::npos &&
        what.find("register_research()") != std::string::npos)
      return;
    std::printf("FAIL %s: %s\n", name.c_str(), error.what());
  }
  ++failures;
}

// A vertex of the upper triangle falls through the lower one.
void expect_contact() {
  const double start[18] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.2, 0.2, 0.1, 2, 2, 3, 2, 3, 3};
  double end[18];
  for (int i = 0; i < 18; ++i) end[i] = start[i];
  end[11] = -0.1;
  const Face faces[2] = {{0, 1, 2}, {3, 4, 5}};
  Topology topology;
  topology.vertex_count = 6;
  topology.faces = {faces, 2};
  for (const bool filter : {true, false}) {
    DetectorOptions options;
    options.algorithm.culling.non_penetration = filter;
    Detector detector(options);
    detector.set_topology(topology);
    if (detector.detect({start, 6}, {end, 6}).size() == 1) continue;
    std::printf("FAIL there is not one contact\n");
    ++failures;
  }
}

}  // namespace

int main() {
  for (const Strategy strategy : kStrategies) {
    AlgorithmOptions algorithm;
    algorithm.strategy = strategy;
    if (strategy != Strategy::lazy_stealing) expect_refusal(algorithm, name(strategy));
  }
  for (const Volume volume : kVolumes) {
    AlgorithmOptions algorithm;
    algorithm.volume = volume;
    if (volume != Volume::box) expect_refusal(algorithm, name(volume));
  }
  AlgorithmOptions cones, orphans;
  cones.culling.normal_cones = true;
  orphans.culling.orphan_sets = true;
  expect_refusal(cones, "normal_cones");
  expect_refusal(orphans, "orphan_sets");
  expect_contact();
  return failures == 0 ? 0 : 1;
}
