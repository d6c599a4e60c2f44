// Detector::recheck_near_pairs(): touching pairs are found among the near pairs of the last
// detection.
#include <random>

#include "lazyccd/detector.h"
#include "support/catch.h"
#include "support/moving_triangles.h"
#include "support/same_contacts.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

DetectorOptions with_separation(double separation) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.separation = separation;
  return options;
}

}  // namespace

TEST_CASE("pairs that touch in a similar motion were near in the first motion") {
  constexpr double separation = 0.02;
  MovingTriangles scene = crowd_of_triangles(1000);
  Detector near_detector(with_separation(separation)), touch_detector(with_separation(0));
  near_detector.set_topology(scene.topology());
  touch_detector.set_topology(scene.topology());
  const Span<const Contact> near = near_detector.detect(scene.at(scene.start), scene.at(scene.end));
  const auto among_near = [&](const std::vector<double>& end) {
    return near_detector.recheck_near_pairs(scene.at(scene.start), scene.at(end));
  };
  const auto touching = [&](const std::vector<double>& end) {
    return touch_detector.detect(scene.at(scene.start), scene.at(end));
  };

  CHECK(touching(scene.end).size() > 500);
  CHECK(near.size() > touching(scene.end).size() + 100);
  CHECK(same_contacts(among_near(scene.end), touching(scene.end)));
  CHECK(same_contacts(among_near(scene.start), touching(scene.start)));

  // Each component changes by less than half the separation over the square root of three.
  std::mt19937 random(3);
  for (double& x : scene.end) x += 0.28 * separation * (random() / 2147483648.0 - 1);
  CHECK(same_contacts(among_near(scene.end), touching(scene.end)));
  CHECK(near_detector.stats().hash == touch_detector.stats().hash);
}

TEST_CASE("one of two bodies may deviate by the whole separation if the other does not") {
  constexpr double separation = 0.02;
  MovingTriangles scene = crowd_of_triangles(1000);
  std::vector<std::int32_t> body_of_vertex;
  for (std::size_t v = 0; v < scene.start.size() / 3; ++v) body_of_vertex.push_back(v / 3 % 2);
  std::vector<Body> bodies(2);
  for (Body& body : bodies) body.self_collision = false;
  Topology topology = scene.topology();
  topology.body_of_vertex = body_of_vertex;
  topology.bodies = bodies;
  Detector near_detector(with_separation(separation)), touch_detector(with_separation(0));
  near_detector.set_topology(topology);
  touch_detector.set_topology(topology);
  near_detector.detect(scene.at(scene.start), scene.at(scene.end));

  // Each component of one body changes by less than the separation over the square root of three.
  std::mt19937 random(3);
  for (std::size_t i = 0; i < scene.end.size(); ++i) {
    if (body_of_vertex[i / 3] == 1)
      scene.end[i] += 0.57 * separation * (random() / 2147483648.0 - 1);
  }
  const auto touching = touch_detector.detect(scene.at(scene.start), scene.at(scene.end));
  CHECK(touching.size() > 200);
  CHECK(same_contacts(near_detector.recheck_near_pairs(scene.at(scene.start), scene.at(scene.end)),
                      touching));
}

TEST_CASE(
    "near pairs are searched again where another motion deviates by more than the separation") {
  const int threads = GENERATE(1, 3);
  const auto strategy = GENERATE(Strategy::lazy_stealing, Strategy::thread_per_query);
  const auto front = GENERATE(FrontUse::off, FrontUse::on);
  const double unit = GENERATE(sweep({1.0, 1e-170, 1e150, 1e-30, 1e30}));
  const double separation = 0.03 * unit;
  const bool within_body = GENERATE(false, true);
  MovingTriangles scene = layers(3, 8, 0.025);
  for (auto* const positions : {&scene.start, &scene.end})
    for (double& x : *positions) x *= unit;
  DetectorOptions options = with_separation(separation);
  options.threads = threads;
  options.reduce_contacts = true;
  options.algorithm.strategy = strategy;
  options.algorithm.front = front;
  Detector near_detector(options), touch_detector(with_separation(0));
  const SheetsAsBodies bodies(scene, 3, separation);
  const Topology topology = within_body ? bodies.topology(scene) : scene.topology();
  near_detector.set_topology(topology);
  touch_detector.set_topology(topology);
  CHECK(!near_detector.can_recheck_any_motion());

  std::mt19937 random(21);
  const auto symmetric = [&] { return random() / 2147483648.0 - 1; };
  std::size_t touching = 0;
  for (int step = 0; step < 5; ++step) {
    scene.start = scene.end;
    for (double& x : scene.end) x += 0.002 * unit * symmetric();
    near_detector.detect(scene.at(scene.start), scene.at(scene.end));
    CHECK(near_detector.can_recheck_any_motion());
    // Nothing, one node, a part of the scene, or all nodes deviate, by up to some separations.
    // One node deviates by far more.
    for (const double by : {0.2, 0.9, 1.1, 3.0, 1e6}) {
      std::vector<double> end = scene.end;
      const std::size_t part[] = {0, 3, end.size() / 9, end.size()};
      const std::size_t count = by > 100 ? 3 : part[random() % 4],
                        first = random() % (end.size() - count + 1);
      for (std::size_t i = first; i < first + count; ++i) end[i] += by * separation * symmetric();
      const auto expected = touch_detector.detect(scene.at(scene.start), scene.at(end));
      CHECK(same_contacts(near_detector.recheck_near_pairs(scene.at(scene.start), scene.at(end)),
                          expected));
      CHECK(near_detector.stats().hash == touch_detector.stats().hash);
      touching += expected.size();
    }
    const auto at_start = touch_detector.detect(scene.at(scene.start), scene.at(scene.start));
    CHECK(same_contacts(
        near_detector.recheck_near_pairs(scene.at(scene.start), scene.at(scene.start)), at_start));
  }
  CHECK(touching > 100);
}

TEST_CASE("a re-check finds the contacts between bodies with any separation") {
  // Squares of the largest ones are not finite. Bodies have limits for themselves.
  const double separation = GENERATE(0.03, 1e20, 1e118, 1e120, 1e121, 1e200);
  MovingTriangles scene = layers(2, 5, 0.025);
  const SheetsAsBodies bodies(scene, 2, 0.01);
  Detector near_detector(with_separation(separation)), touch_detector(with_separation(0));
  near_detector.set_topology(bodies.topology(scene));
  touch_detector.set_topology(bodies.topology(scene));
  near_detector.detect(scene.at(scene.start), scene.at(scene.end));
  for (std::size_t i = scene.end.size() / 2; i < scene.end.size(); ++i)
    if (i % 3 == 1) scene.end[i] -= 0.05;
  const auto touching = touch_detector.detect(scene.at(scene.start), scene.at(scene.end));
  CHECK(touching.size() > 20);
  CHECK(same_contacts(near_detector.recheck_near_pairs(scene.at(scene.start), scene.at(scene.end)),
                      touching));
}

TEST_CASE("a re-check of the same motion finds its contacts at any scale") {
  const double unit = GENERATE(1.0, 1e-158, 1e-170, 1e-300, 1e150);
  CAPTURE(unit);
  // A corner of the second triangle is above the first one and moves through it.
  std::vector<double> start = {0, 0, 0, 3, 0, 0, 0, 0, 3, 1, 0.2, 1, 1.2, 2, 1, 1, 2, 1.2};
  for (double& x : start) x *= unit;
  std::vector<double> end = start;
  end[10] -= 0.4 * unit;
  const std::vector<Face> faces = {{0, 1, 2}, {3, 4, 5}};
  Topology topology;
  topology.vertex_count = 6;
  topology.faces = faces;
  Detector detector(with_separation(0.3 * unit));
  detector.set_topology(topology);
  const Positions from(start.data(), 6), to(end.data(), 6);
  REQUIRE(!detector.detect(from, to).empty());
  CHECK(detector.recheck_near_pairs(from, to).size() == 1);
}
