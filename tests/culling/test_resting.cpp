// Detector::set_resting(): pairs of bodies whose contacts the caller has kept.
#include <algorithm>

#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "support/catch.h"
#include "support/moving_triangles.h"
#include "support/same_contacts.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr int layer_count = 5, layer_size = 8;

// Layers above each other, each a body. They do not move, so Verlet lists are worthwhile.
struct Layers {
  MovingTriangles scene = test::layers(layer_count, layer_size, 0.025);
  std::vector<std::int32_t> body = body_of_each(scene, layer_count);

  Topology topology() const {
    Topology result = scene.topology();
    result.body_of_vertex = body;
    return result;
  }
  Positions start() const { return scene.at(scene.start); }
  Positions end() const { return scene.at(scene.end); }
};

DetectorOptions options(int threads, Strategy strategy, bool reduced) {
  DetectorOptions result;
  result.backend = Backend::cpu;
  result.threads = threads;
  result.separation = 0.03;
  result.reduce_contacts = reduced;
  result.algorithm.strategy = strategy;
  return result;
}

std::vector<Contact> without(const std::vector<Contact>& all, const std::vector<char>& resting) {
  std::vector<Contact> result;
  std::copy_if(all.begin(), all.end(), std::back_inserter(result), [&](const Contact& contact) {
    return !(resting[contact.body_a] && resting[contact.body_b]);
  });
  return result;
}

const std::vector<std::vector<char>> sets = {
    {1, 1, 0, 1, 1}, {0, 1, 1, 1, 0}, {1, 1, 1, 1, 1}, {0, 0, 0, 0, 0}, {1, 0, 1, 0, 1}};

}  // namespace

TEST_CASE("a detection has all contacts but those between resting bodies") {
  const int threads = GENERATE(1, 3);
  const Strategy strategy =
      GENERATE(Strategy::lazy_stealing, Strategy::thread_per_query, Strategy::static_list);
  const bool reduced = GENERATE(false, true);
  CAPTURE(threads, strategy, reduced);
  const Layers layers;
  Detector detector(options(threads, strategy, reduced));
  detector.set_topology(layers.topology());
  const Span<const Contact> found = detector.detect(layers.start(), layers.end());
  const std::vector<Contact> all(found.begin(), found.end());
  REQUIRE(all.size() > 100);
  std::int64_t listed = 0;
  // Several steps with each set: a Verlet list or a front is built with one and used with others.
  for (int round = 0; round < 3; ++round) {
    for (const std::vector<char>& resting : sets) {
      const std::vector<Contact> expected = without(all, resting);
      detector.set_resting(resting);
      for (int step = 0; step < round + 1; ++step) {
        CHECK(same_contacts(detector.detect(layers.start(), layers.end()), expected));
        CHECK(detector.stats().hash == contact_hash(expected));
        if (!reduced)
          CHECK(detector.stats().near_pairs == static_cast<std::int64_t>(expected.size()));
        listed += detector.stats().listed_candidates;
      }
    }
  }
  CHECK(listed > 0);
  detector.set_resting({});
  CHECK(same_contacts(detector.detect(layers.start(), layers.end()), all));
  detector.set_resting(sets[0]);
  detector.set_topology(layers.topology());
  CHECK(same_contacts(detector.detect(layers.start(), layers.end()), all));
}

TEST_CASE("pairs of resting bodies are neither visited nor tested") {
  const Layers layers;
  Detector detector(options(1, Strategy::lazy_stealing, true));
  detector.set_topology(layers.topology());
  detector.set_resting(sets[2]);
  detector.detect(layers.start(), layers.end());
  CHECK(detector.stats().tree_tests == 1);
  CHECK(detector.stats().candidates_vf + detector.stats().candidates_ee == 0);
}

TEST_CASE("a re-check has no pairs of resting bodies") {
  const Layers layers;
  Detector detector(options(1, Strategy::lazy_stealing, true));
  Detector touching(DetectorOptions{});
  detector.set_topology(layers.topology());
  touching.set_topology(layers.topology());
  // The layers fall through each other.
  std::vector<double> deep = layers.scene.start;
  for (std::size_t v = 0; v < layers.body.size(); ++v) deep[3 * v + 1] -= 0.1 * layers.body[v];
  const Positions end = layers.scene.at(deep);
  const Span<const Contact> found = touching.detect(layers.start(), end);
  const std::vector<Contact> all(found.begin(), found.end());
  for (const std::vector<char>& resting : sets) {
    detector.set_resting(resting);
    detector.detect(layers.start(), layers.end());
    CHECK(same_contacts(detector.recheck_near_pairs(layers.start(), end), without(all, resting)));
  }
}

TEST_CASE("a detection that was started ahead with other resting bodies is discarded") {
  const Layers layers;
  Detector detector(options(2, Strategy::lazy_stealing, true));
  detector.set_topology(layers.topology());
  const Span<const Contact> found = detector.detect(layers.start(), layers.end());
  const std::vector<Contact> all(found.begin(), found.end());
  detector.set_resting(sets[0]);
  detector.detect_ahead(layers.start(), layers.end(), 0.01);
  detector.set_resting(sets[1]);
  CHECK(same_contacts(detector.detect(layers.start(), layers.end()), without(all, sets[1])));
  CHECK(!detector.stats().started_ahead);
}

TEST_CASE("a re-check needs a detection with the same resting bodies") {
  const Layers layers;
  Detector detector(options(1, Strategy::lazy_stealing, true));
  detector.set_topology(layers.topology());
  CHECK(detector.set_resting(sets[0]));
  CHECK(!detector.set_resting(sets[0]));
  detector.detect(layers.start(), layers.end());
  CHECK(detector.set_resting({}));
  CHECK_THROWS_AS(detector.recheck_near_pairs(layers.start(), layers.end()), Error);
  CHECK(!detector.set_resting(sets[3]));                          // none rests
  CHECK(detector.set_resting(std::vector<char>{2, 2, 0, 0, 0}));  // what is not 0 rests
}

TEST_CASE("resting bodies need a separation and an entry for each body") {
  const Layers layers;
  Detector detector(options(1, Strategy::lazy_stealing, true)), touching(DetectorOptions{});
  detector.set_topology(layers.topology());
  touching.set_topology(layers.topology());
  CHECK_THROWS_AS(detector.set_resting(std::vector<char>(3)), Error);
  CHECK_THROWS_AS(touching.set_resting({}), Error);
}
