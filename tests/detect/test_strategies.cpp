// Strategies are found by name and find the same contacts. Also tests when a front is outdated.
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "core/bvh/front_policy.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "support/catch.h"
#include "support/moving_triangles.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

MovingTriangles triangle_cloud(std::int32_t triangles) {
  MovingTriangles cloud;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::int32_t f = 0; f < triangles; ++f) {
    const double centre[3] = {uniform(random), uniform(random), uniform(random)};
    for (int i = 0; i < 9; ++i) {
      cloud.start.push_back(centre[i % 3] + 0.08 * uniform(random));
      cloud.end.push_back(cloud.start.back() + 0.04 * (uniform(random) - 0.5));
    }
    cloud.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  return cloud;
}

}  // namespace

TEST_CASE("a strategy is found by its name, and an unknown name is refused with the known ones") {
  for (const Strategy strategy : kStrategies) CHECK(parse_strategy(name(strategy)) == strategy);
  try {
    parse_strategy("eager");
    FAIL("nothing was thrown");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::invalid_argument);
    for (const Strategy strategy : kStrategies)
      CHECK(std::string(error.what()).find(name(strategy)) != std::string::npos);
  }
}

TEST_CASE("every strategy finds the same contacts on any number of threads from root and front") {
  const MovingTriangles cloud = triangle_cloud(1500);
  std::set<std::uint64_t> hashes;
  std::set<std::int64_t> pairs;
  for (const Strategy strategy : kStrategies) {
    for (const int threads : {1, 2, 5}) {
      for (const FrontUse front : {FrontUse::off, FrontUse::on}) {
        DetectorOptions options;
        options.backend = Backend::cpu;
        options.threads = threads;
        options.algorithm.strategy = strategy;
        options.algorithm.front = front;
        Detector detector(options);
        detector.set_topology(cloud.topology());
        for (int step = 0; step < 3; ++step) {
          CHECK(!detector.detect(cloud.at(cloud.start), cloud.at(cloud.end)).empty());
          hashes.insert(detector.stats().hash);
          pairs.insert(detector.stats().group_pairs);
          const bool fronts = front == FrontUse::on && strategy != Strategy::thread_per_query;
          CHECK(detector.stats().front_reused == (fronts && step > 0));
        }
      }
    }
  }
  CHECK(hashes.size() == 1);
  CHECK(pairs.size() == 1);
}

TEST_CASE("the stages of a step share its wall time") {
  const MovingTriangles cloud = triangle_cloud(3000);
  for (const Strategy strategy : kStrategies) {
    DetectorOptions options;
    options.backend = Backend::cpu;
    options.threads = 2;
    options.algorithm.strategy = strategy;
    Detector detector(options);
    detector.set_topology(cloud.topology());
    detector.detect(cloud.at(cloud.start), cloud.at(cloud.end));
    const Stats& s = detector.stats();
    CAPTURE(name(strategy));
    CHECK(s.ms_narrow > 0);
    CHECK(s.idle_share >= 0);
    CHECK(s.idle_share <= 1);
    CHECK(s.ms_refit + s.ms_traverse + s.ms_balance + s.ms_narrow + s.ms_front + s.ms_sort <=
          1.01 * s.ms_total + 0.1);
  }
}

TEST_CASE("a negative tuning size is refused") {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.algorithm.tuning.idle_threshold = -1;
  CHECK_THROWS_AS(Detector(options), Error);
}

TEST_CASE("a front that no longer grows is rebuilt once and then reused again") {
  FrontPolicy policy(2, 1.02);
  CHECK(!policy.reuse());
  policy.saved(100, false);
  CHECK(policy.reuse());
  policy.saved(110, true);
  policy.saved(120, true);
  CHECK(policy.reuse());  // 120 of 100
  policy.saved(121, true);
  CHECK(policy.reuse());  // 121 of 110
  policy.saved(122, true);
  CHECK(!policy.reuse());  // 122 of 120
  policy.saved(90, false);
  CHECK(policy.reuse());
  policy.forget();
  CHECK(!policy.reuse());
}
