// With a separation, candidates that outlast a step.
#include <random>

#include "lazyccd/detector.h"
#include "support/catch.h"
#include "support/moving_triangles.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

Options with_separation(double separation, int threads) {
  Options options;
  options.backend = Backend::cpu;
  options.threads = threads;
  options.separation = separation;
  return options;
}

}  // namespace

TEST_CASE("what comes near is the same with candidates of earlier steps as with new ones") {
  constexpr double separation = 0.04;
  MovingTriangles scene = crowd_of_triangles(400);
  std::mt19937 random(11);
  const auto move = [&](double by) {
    scene.start = scene.end;
    for (double& x : scene.end) x += by * (random() / 2147483648.0 - 1);
  };
  scene.end = scene.start;
  Detector lasting(with_separation(separation, 2));
  lasting.set_topology(scene.topology());
  int listed = 0, sought = 0;
  // Slow, with a jump, a fast step and a slow one after each.
  for (const double by : {0.0,   0.001, 0.002, 0.003, 0.004, 0.004, 0.004, 0.004, 0.004, 0.004,
                          0.004, 0.004, 0.3,   0.001, 0.001, 0.009, 0.001, 0.011, 0.001, 0.001}) {
    move(by);
    Detector fresh(with_separation(separation, 1));
    fresh.set_topology(scene.topology());
    const auto detect = [&](Detector& detector) {
      return detector.detect(scene.at(scene.start), scene.at(scene.end)).size();
    };
    const std::size_t near = detect(fresh);
    CHECK(near > 100);
    CHECK(detect(lasting) == near);
    CHECK(lasting.stats().hash == fresh.stats().hash);
    (lasting.stats().tree_tests == 0 ? listed : sought) += 1;
  }
  CHECK(listed > 0);
  CHECK(sought > 0);

  // The same places with another topology.
  scene.faces.pop_back();
  lasting.set_topology(scene.topology());
  Detector fresh(with_separation(separation, 1));
  fresh.set_topology(scene.topology());
  lasting.detect(scene.at(scene.start), scene.at(scene.end));
  fresh.detect(scene.at(scene.start), scene.at(scene.end));
  CHECK(lasting.stats().hash == fresh.stats().hash);
}
