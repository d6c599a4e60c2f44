// The Verlet list: with a separation, candidates are reused in later steps.
#include <random>

#include "cpu/verlet/verlet_list.h"
#include "lazyccd/detector.h"
#include "support/catch.h"
#include "support/moving_triangles.h"
#include "support/same_contacts.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

DetectorOptions with_separation(double separation, int threads) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.threads = threads;
  options.separation = separation;
  return options;
}

}  // namespace

TEST_CASE("near pairs are the same with candidates of earlier steps and with new ones") {
  constexpr double separation = 0.04;
  MovingTriangles scene = crowd_of_triangles(400);
  std::mt19937 random(11);
  const auto move = [&](double by) {
    scene.start = scene.end;
    for (double& x : scene.end) x += by * (random() / 2147483648.0 - 1);
  };
  scene.end = scene.start;
  Detector reusing(with_separation(separation, 2));
  reusing.set_topology(scene.topology());
  int listed = 0, searched = 0;
  // Slow steps, then a jump and two fast steps, each followed by slow ones.
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
    CHECK(detect(reusing) == near);
    CHECK(reusing.stats().hash == fresh.stats().hash);
    (reusing.stats().tree_tests == 0 ? listed : searched) += 1;
  }
  CHECK(listed > 0);
  CHECK(searched > 0);

  // The same positions with another topology.
  scene.faces.pop_back();
  reusing.set_topology(scene.topology());
  Detector fresh(with_separation(separation, 1));
  fresh.set_topology(scene.topology());
  reusing.detect(scene.at(scene.start), scene.at(scene.end));
  fresh.detect(scene.at(scene.start), scene.at(scene.end));
  CHECK(reusing.stats().hash == fresh.stats().hash);
}

TEST_CASE("reused candidates give the same contacts in every history of motions") {
  const double separation = GENERATE(sweep({0.005, 0.06, 0.022}));
  const bool distinct = GENERATE(false, true), within_body = GENERATE(false, true);
  const MovingTriangles rest = layers(3, 6, 0.02);
  MovingTriangles scene = rest;
  DetectorOptions options = with_separation(separation, 2);
  options.reduce_contacts = distinct;
  options.algorithm.arithmetic = distinct ? Arithmetic::single_first : Arithmetic::double_only;
  Detector reusing(options);
  options.threads = 1;
  Detector fresh(options);
  const SheetsAsBodies bodies(rest, 3, separation);
  const Topology topology = within_body ? bodies.topology(scene) : scene.topology();
  reusing.set_topology(topology);

  std::mt19937 random(3);
  const auto symmetric = [&] { return random() / 2147483648.0 - 1; };
  // Size of a step in units of the separation. All nodes move randomly, or one, or all in common.
  constexpr double sizes[] = {0, 1e-12, 1e-6, 1e-3, 0.02, 0.05, 0.1, 0.24, 0.26, 1, 30};
  int listed = 0;
  for (int step = 0; step < 60; ++step) {
    scene.start = step % 13 == 12 ? rest.start : scene.end;
    scene.end = scene.start;
    const double by = separation * sizes[step < 20 ? step % 6 : random() % 11];
    const bool together = random() % 3 == 0, one = random() % 3 == 0;
    const double drift[3] = {symmetric(), symmetric(), symmetric()};
    const std::size_t chosen = random() % (scene.end.size() / 3);
    for (std::size_t i = 0; i < scene.end.size(); ++i)
      if (!one || i / 3 == chosen) scene.end[i] += by * (together ? drift[i % 3] : symmetric());
    fresh.set_topology(topology);
    const Positions start = scene.at(scene.start), end = scene.at(scene.end);
    const Span<const Contact> found = reusing.detect(start, end);
    listed += reusing.stats().tree_tests == 0;
    CHECK(same_contacts(found, fresh.detect(start, end)));
    CHECK(same_contacts(reusing.recheck_near_pairs(start, end),
                        fresh.recheck_near_pairs(start, end)));
  }
  CHECK(listed > 10);
}

TEST_CASE("reused candidates give the same contacts in scenes of any size") {
  const double unit = GENERATE(1e-300, 1e-160, 1e-30, 1e30, 1e150);
  const bool within_body = GENERATE(false, true);
  MovingTriangles scene = layers(2, 5, 0.02);
  Detector reusing(with_separation(0.022 * unit, 1)), fresh(with_separation(0.022 * unit, 1));
  const SheetsAsBodies bodies(scene, 2, 0.022 * unit);
  const Topology topology = within_body ? bodies.topology(scene) : scene.topology();
  reusing.set_topology(topology);
  for (double& x : scene.end) x *= unit;
  std::mt19937 random(9);
  std::vector<double> motion;  // of each step
  for (std::size_t i = 0; i < scene.end.size(); ++i)
    motion.push_back(0.002 * unit * (random() / 2147483648.0 - 1));
  for (int step = 0; step < 12; ++step) {
    scene.start = scene.end;
    for (std::size_t i = 0; i < scene.end.size(); ++i) scene.end[i] += motion[i];
    fresh.set_topology(topology);
    const Positions start = scene.at(scene.start), end = scene.at(scene.end);
    const Span<const Contact> found = reusing.detect(start, end);
    CHECK(found.size() > 100);
    CHECK(same_contacts(found, fresh.detect(start, end)));
  }
}

TEST_CASE("candidates stay valid if all vertices move alike at any speed") {
  MovingTriangles scene = layers(2, 12, 0.02);
  Detector reusing(with_separation(0.022, 1)), fresh(with_separation(0.022, 1));
  reusing.set_topology(scene.topology());
  std::mt19937 random(2);
  for (int step = 0; step < 12; ++step) {
    scene.start = scene.end;
    for (std::size_t i = 0; i < scene.end.size(); ++i)
      scene.end[i] += (i % 3 == 0 ? 0.3 : -0.1) + 1e-5 * (random() / 2147483648.0 - 1);
    const Positions start = scene.at(scene.start), end = scene.at(scene.end);
    fresh.set_topology(scene.topology());
    CHECK(same_contacts(reusing.detect(start, end), fresh.detect(start, end)));
    if (step > 1) CHECK(reusing.stats().tree_tests == 0);
  }
}

TEST_CASE("reused candidates give the same contacts next to groups that move by themselves") {
  const Strategy strategy = GENERATE(Strategy::lazy_stealing, Strategy::thread_per_query);
  const FrontUse front = GENERATE(FrontUse::off, FrontUse::on);
  const double rebuild_ratio = GENERATE(1.5, 1e-9);
  constexpr int sheets = 3, nodes = 14;
  constexpr std::size_t sheet_size = 3 * nodes * nodes;
  const MovingTriangles rest = layers(sheets, nodes, 0.02);
  MovingTriangles scene = rest;
  DetectorOptions options = with_separation(0.022, 2);
  options.reduce_contacts = true;
  options.algorithm.strategy = strategy;
  options.algorithm.front = front;
  options.algorithm.rebuild_ratio = rebuild_ratio;
  Detector reusing(options);
  options.threads = 1;
  options.algorithm.front = FrontUse::off;
  Detector fresh(options);
  reusing.set_topology(scene.topology());
  std::mt19937 random(8);
  const auto symmetric = [&] { return random() / 2147483648.0 - 1; };
  int in_part = 0;
  for (int step = 0; step < 40; ++step) {
    scene.start = step % 17 == 16 ? rest.start : scene.end;
    scene.end = scene.start;
    // One sheet flies, far away or through the others. A few nodes shake and all creep.
    const std::size_t flying = step / 5 % sheets, shaking = random() % (sheets * sheet_size - 30);
    const double fly = step % 3 == 0 ? 0.02 * symmetric() : 0.3 * (step / 5 % 2);
    const double shake = step % 2 == 0 ? 0.02 : 0;
    for (std::size_t i = 0; i < scene.end.size(); ++i) {
      if (i / sheet_size == flying) scene.end[i] += fly;
      if (i - shaking < 30) scene.end[i] += shake * symmetric();
      scene.end[i] += 1e-4 * symmetric();
    }
    fresh.set_topology(scene.topology());
    const Positions start = scene.at(scene.start), end = scene.at(scene.end);
    CHECK(same_contacts(reusing.detect(start, end), fresh.detect(start, end)));
    const Stats &with = reusing.stats(), &without = fresh.stats();
    in_part += with.tree_tests > 0 && with.group_pairs < without.group_pairs;
    CHECK(same_contacts(reusing.recheck_near_pairs(start, end),
                        fresh.recheck_near_pairs(start, end)));
  }
  if (rebuild_ratio > 1) CHECK(in_part > 5);
}

TEST_CASE("candidates are reused where nodes creep, while others fly") {
  constexpr int sheets = 4, nodes = 12;
  constexpr std::size_t sheet_size = 3 * nodes * nodes;
  MovingTriangles scene = layers(sheets, nodes, 0.02);
  // Bodies of their own, so that no group has faces of two sheets.
  std::vector<std::int32_t> body_of_vertex;
  for (std::size_t v = 0; v < scene.start.size() / 3; ++v)
    body_of_vertex.push_back(static_cast<std::int32_t>(3 * v / sheet_size));
  const std::vector<Body> bodies(sheets);
  Topology topology = scene.topology();
  topology.body_of_vertex = body_of_vertex;
  topology.bodies = bodies;
  DetectorOptions options = with_separation(0.022, 2);
  Detector reusing(options);
  options.threads = 1;
  Detector fresh(options);
  reusing.set_topology(topology);
  std::mt19937 random(4);
  const auto symmetric = [&] { return random() / 2147483648.0 - 1; };
  int in_part = 0;
  for (int step = 0; step < 40; ++step) {
    scene.start = scene.end;
    for (std::size_t i = 0; i < scene.end.size(); ++i) {
      scene.end[i] += 1e-4 * symmetric();
      // The last sheet flies to and fro through the others, then stops.
      if (i / sheet_size == sheets - 1 && i % 3 == 1 && step < 30)
        scene.end[i] += (step % 4 < 2 ? 0.05 : -0.05) + 0.01 * symmetric();
    }
    fresh.set_topology(topology);
    const Positions start = scene.at(scene.start), end = scene.at(scene.end);
    CHECK(same_contacts(reusing.detect(start, end), fresh.detect(start, end)));
    in_part += 4 * reusing.stats().group_pairs < 3 * fresh.stats().group_pairs;
    CHECK(same_contacts(reusing.recheck_near_pairs(start, end),
                        fresh.recheck_near_pairs(start, end)));
  }
  CHECK(in_part > 30);
}

TEST_CASE("a Verlet list that does not pay is left out for longer and longer") {
  VerletList list(0.01, 1);
  // Steps without a list, until the next one is worthwhile.
  const auto pause = [&list](std::int64_t visited) {
    int steps = 0;
    do {
      list.record_probe(visited, 0, true);
      ++steps;
    } while (!list.is_worthwhile(1));
    return steps;
  };
  const auto use_up = [&list](int steps) {
    list.finish_building(2000, 0);
    for (int i = 0; i < steps; ++i) list.record_use(10, 0);
    CHECK(list.has_list());
    list.record_use(3000, 0);
    CHECK_FALSE(list.has_list());
  };
  CHECK(pause(1000) == 1);
  for (const int steps : {1, 2, 4, 8}) {
    use_up(0);  // costs twice as much as without
    CHECK(pause(1000) == steps);
  }
  use_up(20);
  CHECK(list.is_worthwhile(1));
  use_up(0);
  CHECK(pause(1000) == 1);
}
