// Strategies by name; the baseline finds what the default finds; when a front is outdated.
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "core/front_policy.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "support/catch.h"

using namespace lazyccd;

TEST_CASE("a strategy is found by its name, and an unknown name is refused with the known ones") {
  for (const Strategy strategy : kStrategies) CHECK(parse_strategy(name(strategy)) == strategy);
  try {
    parse_strategy("eager");
    FAIL("nothing was thrown");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::invalid_argument);
    CHECK(std::string(error.what()).find("lazy_stealing, thread_per_query") != std::string::npos);
  }
}

TEST_CASE("one thread a query finds the contacts that lazy stealing finds") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> start, end;
  std::vector<Face> faces;
  for (std::int32_t f = 0; f < 1500; ++f) {
    const double centre[3] = {uniform(random), uniform(random), uniform(random)};
    for (int i = 0; i < 9; ++i) {
      start.push_back(centre[i % 3] + 0.08 * uniform(random));
      end.push_back(start.back() + 0.04 * (uniform(random) - 0.5));
    }
    faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  Topology topology;
  topology.vertex_count = start.size() / 3;
  topology.faces = faces;
  Options options;
  options.backend = Backend::cpu;
  options.threads = 2;
  std::vector<std::uint64_t> hashes, pairs;
  for (const Strategy strategy : kStrategies) {
    options.strategy = strategy;
    Detector detector(options);
    detector.set_topology(topology);
    CHECK(!detector.detect({start.data(), topology.vertex_count}, {end.data(), topology.vertex_count})
               .empty());
    hashes.push_back(detector.stats().hash);
    pairs.push_back(static_cast<std::uint64_t>(detector.stats().group_pairs));
  }
  CHECK(hashes[0] == hashes[1]);
  CHECK(pairs[0] == pairs[1]);
}

TEST_CASE("a front that no longer grows is made anew once, and then reused again") {
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
