// Detector::detect_ahead(): compares detections that started before the step's end was known with
// detections that did not.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "cpu/narrow/contact_sort.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "support/catch.h"
#include "support/moving_triangles.h"
#include "support/same_contacts.h"
#include "support/sheets_ahead.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr Expectation expectations[] = {Expectation::exact,       Expectation::within,
                                        Expectation::within,      Expectation::beyond,
                                        Expectation::other_start, Expectation::none};

// Compares steps with all kinds of expectations. Returns how many detections were started ahead.
int compare_steps(const DetectorOptions& options, int steps, int nodes, bool as_bodies = false) {
  DetectorPair both(options);
  Sheets sheets(nodes);
  Topology topology = sheets.scene.topology();
  // Some vertices are pinned. Within a sheet the separation is at most self_separation.
  const std::vector<std::int32_t> bodies = body_of_each(sheets.scene, 3);
  std::vector<float> inverse_mass(bodies.size(), 1.0f), self_separation(bodies.size(), 0.01f);
  std::fill_n(inverse_mass.begin(), bodies.size() / 5, 0.0f);
  if (as_bodies) {
    topology.body_of_vertex = bodies;
    topology.inverse_mass = inverse_mass;
    topology.self_separation = self_separation;
  }
  both.set_topology(topology);
  int started_ahead = 0;
  for (int step = 0; step < steps; ++step) {
    // Two steps of each kind in a row.
    const Expectation expectation = expectations[step / 2 % std::size(expectations)];
    sheets.move(expectation);
    if (expectation != Expectation::none) {
      both.with.detect_ahead(sheets.scene.at(sheets.expected_start),
                             sheets.scene.at(sheets.expected_end), Sheets::tolerance);
      if (options.threads > 1 && step % 3 != 1) wait_until_ahead_is_done(both.threads);
    }
    CAPTURE(step, static_cast<int>(expectation));
    const bool is_started_ahead = both.compare(sheets.scene).started_ahead;
    started_ahead += is_started_ahead;
    if (expectation != Expectation::exact && expectation != Expectation::within)
      CHECK(!is_started_ahead);
  }
  return started_ahead;
}

}  // namespace

TEST_CASE("detections started ahead find the same contacts whether the expectation holds or not") {
  const Strategy strategy = GENERATE(from_range(std::begin(kStrategies), std::end(kStrategies)));
  const int threads = GENERATE(1, 2, 4);
  const FrontUse front = GENERATE(FrontUse::off, FrontUse::on);
  CAPTURE(name(strategy), threads, front == FrontUse::on);
  DetectorOptions options = with_separation(Sheets::separation, threads);
  options.algorithm.strategy = strategy;
  options.algorithm.front = front;
  options.reduce_contacts = true;
  const int started_ahead = compare_steps(options, 48, 9, threads == 2);
  // Static lists do not start ahead: their rounds wait for all threads.
  CHECK((started_ahead > 0) == (threads > 1 && strategy != Strategy::static_list));
}

TEST_CASE("detections start ahead with all options that allow it") {
  DetectorOptions options = with_separation(Sheets::separation, 2);
  SECTION("bounding volumes") {
    options.algorithm.volume = GENERATE(Volume::dop18, Volume::oriented_box);
    CHECK(compare_steps(options, 24, 9, true) == 0);  // other volumes have no tolerance
  }
  SECTION("culling") {
    options.algorithm.culling = {true, true, true};
    CHECK(compare_steps(options, 48, 9) > 0);
  }
  SECTION("a new tree every step") {
    options.algorithm.rebuild_every_step = true;
    CHECK(compare_steps(options, 24, 9) > 0);
  }
  SECTION("a tree rebuilt by its cost ratio") {
    options.algorithm.rebuild_ratio = 1e-9;
    options.algorithm.front = FrontUse::on;
    CHECK(compare_steps(options, 24, 9) > 0);
  }
  SECTION("double precision alone") {
    options.algorithm.arithmetic = Arithmetic::double_only;
    options.reduce_contacts = GENERATE(false, true);
    CHECK(compare_steps(options, 24, 7) > 0);
  }
  SECTION("one kind of test") {
    (GENERATE(false, true) ? options.vertex_face : options.edge_edge) = false;
    options.reduce_contacts = GENERATE(false, true);
    CHECK(compare_steps(options, 48, 9) > 0);
  }
  SECTION("more vertices than one thread handles") { CHECK(compare_steps(options, 12, 40) > 0); }
}

TEST_CASE("the normal of a contact that begins at distance zero depends on the end of the step") {
  MovingTriangles scene;
  scene.faces = {{0, 1, 2}, {3, 4, 5}};
  scene.start = {0, 0, 0, 1, 0, 0, 0, 0, 1, 0.25, 0, 0.25, 0.25, 1, 0.25, 0.25, 1, 0.5};
  scene.end = scene.start;
  const std::vector<double> expected = scene.end;
  DetectorPair both(with_separation(0.125, 2));
  both.set_topology(scene.topology());
  for (const double moves : {0.015625, -0.015625}) {
    scene.end[3 * 3 + 1] = moves;
    both.with.detect_ahead(scene.at(scene.start), scene.at(expected), 0.03125);
    wait_until_ahead_is_done(both.threads);
    CHECK(both.compare(scene).started_ahead);
  }
}

TEST_CASE("signs of zeros in a normal do not depend on the expected end of the step") {
  MovingTriangles scene;
  scene.faces = {{0, 1, 2}, {3, 4, 5}};
  scene.start = {0, 0, 0, 1, 0, 0, 0, 0, 1, -0.0, 0.0625, 0, -1, 1, 0, -1, 1, -1};
  scene.end = scene.start;
  std::vector<double> expected = scene.end;
  DetectorPair both(with_separation(0.125, 2));
  both.set_topology(scene.topology());
  for (const double moves : {0.015625, -0.015625}) {
    expected[3 * 3] = moves;
    scene.end[3 * 3] = -moves;
    both.with.detect_ahead(scene.at(scene.start), scene.at(expected), 0.0625);
    wait_until_ahead_is_done(both.threads);
    CHECK(both.compare(scene).started_ahead);
  }
}

TEST_CASE("pairs that come nearer than expected are found with every bounding volume") {
  DetectorOptions options = with_separation(0.022, 2);
  options.algorithm.volume = GENERATE(Volume::box, Volume::dop18, Volume::oriented_box);
  options.edge_edge = GENERATE(false, true);
  // The sheets are rotated by 45 degrees, so that axis-aligned boxes overlap.
  MovingTriangles scene = layers(2, 7, 0.04);
  for (std::size_t i = 0; i < scene.start.size(); i += 3) {
    const double x = scene.start[i], y = scene.start[i + 1], root = std::sqrt(0.5);
    scene.start[i] = root * (x - y);
    scene.start[i + 1] = root * (x + y);
  }
  const auto positions_at_gap = [&](double gap) {
    std::vector<double> end = scene.start;
    for (std::size_t i = end.size() / 2; i < end.size(); ++i)
      if (i % 3 != 2) end[i] += (i % 3 == 0 ? 1 : -1) * std::sqrt(0.5) * (0.04 - gap);
    return end;
  };
  const std::vector<double> expected = positions_at_gap(0.03);
  scene.end = positions_at_gap(0.0215);
  DetectorPair both(options);
  Topology topology = scene.topology();
  const std::vector<std::int32_t> bodies = body_of_each(scene, 2);
  topology.body_of_vertex = bodies;
  both.set_topology(topology);
  both.with.detect_ahead(scene.at(scene.start), scene.at(expected), 0.01);
  wait_until_ahead_is_done(both.threads);
  both.compare(scene);
  CHECK(both.without.detect(scene.at(scene.start), scene.at(scene.end)).size() > 50);
}

TEST_CASE("the expected end is compared correctly in scenes of any size") {
  const double unit = GENERATE(1e-300, 1e-170, 1e-30, 1, 1e30, 1e150, 1e290);
  const double off = GENERATE(0.5, 2.0);
  CAPTURE(unit, off);
  constexpr double separation = 0.022, tolerance = 0.01;
  MovingTriangles scene = layers(2, 7, 0.04);
  for (double& x : scene.start) x *= unit;
  scene.end = scene.start;
  DetectorPair both(with_separation(separation * unit, 2));
  both.set_topology(scene.topology());
  both.compare(scene);
  // The sheets approach each other more than expected, by `off` tolerances.
  const std::vector<double> expected = scene.end;
  for (std::size_t i = scene.end.size() / 2; i < scene.end.size(); ++i)
    if (i % 3 == 1) scene.end[i] -= off * tolerance * unit;
  both.with.detect_ahead(scene.at(scene.start), scene.at(expected), tolerance * unit);
  wait_until_ahead_is_done(both.threads);
  CHECK(both.compare(scene).started_ahead == (off < 1));
  // One vertex flies away.
  scene.end.back() += 1e6 * unit;
  both.with.detect_ahead(scene.at(scene.start), scene.at(expected), tolerance * unit);
  wait_until_ahead_is_done(both.threads);
  CHECK(!both.compare(scene).started_ahead);
}

TEST_CASE("a detection starts again if the scene has another size than expected") {
  MovingTriangles scene = layers(2, 6, 0.02);
  // The width along x is slightly less than a power of two; at the end of the step slightly more.
  double least = 1;
  for (std::size_t i = 0; i < scene.start.size(); i += 3) least = std::min(least, scene.start[i]);
  const std::size_t farthest = scene.start.size() - 3;
  scene.start[farthest] = least + 1 - 1e-3;
  scene.end = scene.start;
  const std::vector<double> expected = scene.end;
  scene.end[farthest] += 2e-3;
  DetectorPair both(with_separation(0.022, 2));
  both.set_topology(scene.topology());
  both.with.detect_ahead(scene.at(scene.start), scene.at(expected), 0.01);
  wait_until_ahead_is_done(both.threads);
  CHECK(!both.compare(scene).started_ahead);
}

TEST_CASE(
    "candidates of earlier steps are used ahead and made although no expectation ever holds") {
  const bool comes = GENERATE(false, true);
  DetectorPair both(with_separation(0.022, 2));
  MovingTriangles scene = layers(3, 9, 0.02);
  both.set_topology(scene.topology());
  int started_ahead = 0, listed = 0;
  for (int step = 0; step < 24; ++step) {
    scene.start = scene.end;
    for (std::size_t i = 0; i < scene.end.size(); ++i) scene.end[i] += 1e-5 * (i % 7);
    std::vector<double> expected = scene.end;
    if (!comes) expected[step] += 0.01;
    both.with.detect_ahead(scene.at(scene.start), scene.at(expected), 1e-3);
    wait_until_ahead_is_done(both.threads);
    const Stats stats = both.compare(scene);
    started_ahead += stats.started_ahead;
    listed += stats.tree_tests == 0;
  }
  CHECK(started_ahead == (comes ? 24 : 0));
  CHECK(listed > 10);
}

TEST_CASE("candidates of earlier steps remain valid if pairs come nearer than expected") {
  DetectorPair both(with_separation(0.022, 2));
  MovingTriangles scene = layers(2, 7, 0.029);
  both.set_topology(scene.topology());
  for (int step = 0; step < 12; ++step) {
    scene.start = scene.end;
    for (std::size_t i = 0; i < scene.end.size(); ++i) scene.end[i] += 1e-6 * (i % 7);
    both.compare(scene);
  }
  scene.start = scene.end;
  const std::vector<double> expected = scene.end;
  for (std::size_t i = scene.end.size() / 2; i < scene.end.size(); ++i)
    if (i % 3 == 1) scene.end[i] -= 0.0075;
  both.with.detect_ahead(scene.at(scene.start), scene.at(expected), 0.009);
  wait_until_ahead_is_done(both.threads);
  const Stats stats = both.compare(scene);
  CHECK(stats.started_ahead);
  CHECK(stats.tree_tests == 0);
  CHECK(both.without.detect(scene.at(scene.start), scene.at(scene.end)).size() > 50);
}

TEST_CASE("a detection started ahead may be cancelled or replaced and its input may be wrong") {
  const bool is_done = GENERATE(false, true);
  DetectorPair both(with_separation(Sheets::separation, 2));
  Sheets sheets(9);
  both.set_topology(sheets.scene.topology());
  Detector& detector = both.with;
  const auto start = [&] { return sheets.scene.at(sheets.scene.start); };
  const auto end = [&] { return sheets.scene.at(sheets.scene.end); };
  const auto detect_ahead = [&] {
    detector.detect_ahead(sheets.scene.at(sheets.expected_start),
                          sheets.scene.at(sheets.expected_end), Sheets::tolerance);
    if (is_done) wait_until_ahead_is_done(both.threads);
  };
  const auto next = [&] { sheets.move(Expectation::within); };
  const auto throws = [&](ErrorCode code, const auto& call) {
    try {
      call();
      FAIL("nothing was thrown");
    } catch (const Error& error) {
      CHECK(error.code() == code);
    }
  };
  next();
  detect_ahead();
  SECTION("replaced by the next step") {
    for (int i = 0; i < 4; ++i) {
      next();
      detect_ahead();
    }
  }
  SECTION("replaced by the same step") {
    both.compare(sheets.scene);
    detect_ahead();
    detect_ahead();
  }
  SECTION("cancelled by another topology") {
    sheets.scene.faces.pop_back();
    both.set_topology(sheets.scene.topology());
    CHECK(detector.recheck_near_pairs(start(), end()).size() == 0);
    detect_ahead();
  }
  SECTION("cancelled by a topology that is refused") {
    Topology bad = sheets.scene.topology();
    bad.vertex_count = 2;
    CHECK_THROWS_AS(detector.set_topology(bad), Error);
  }
  SECTION("cancelled by a detector that is assigned") {
    Detector other(with_separation(Sheets::separation, 2), both.threads);
    other.set_topology(sheets.scene.topology());
    detector = std::move(other);
    detect_ahead();
  }
  SECTION("cancelled by the destructor") {
    Detector other(with_separation(Sheets::separation, 2));
    other.set_topology(sheets.scene.topology());
    other.detect_ahead(start(), end(), 0);
  }
  SECTION("while the caller runs a parallel loop") {
    std::vector<int> calls(5000);  // not atomic: the parts are disjoint
    both.threads.parallel_for(calls.size(), 7, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i < last; ++i) ++calls[i];
    });
    CHECK(calls == std::vector<int>(5000, 1));
  }
  SECTION("before a recheck of near pairs") {
    throws(ErrorCode::invalid_argument, [&] { detector.recheck_near_pairs(start(), end()); });
  }
  SECTION("before positions that are not finite") {
    std::vector<double> bad = sheets.scene.end;
    bad[bad.size() / 2] =
        GENERATE(std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity());
    throws(ErrorCode::non_finite_position, [&] { detector.detect(start(), sheets.scene.at(bad)); });
    throws(ErrorCode::invalid_argument, [&] { detector.recheck_near_pairs(start(), end()); });
    both.compare(sheets.scene);
    detect_ahead();
  }
  SECTION("before too one_position positions") {
    const Positions one_position(sheets.scene.end.data(), 3);
    throws(ErrorCode::size_mismatch, [&] { detector.detect(start(), one_position); });
    throws(ErrorCode::size_mismatch, [&] { detector.detect(one_position, one_position); });
  }
  SECTION("with expected positions that are not finite") {
    sheets.expected_end[7] = std::numeric_limits<double>::quiet_NaN();
    detect_ahead();
    CHECK(!both.compare(sheets.scene).started_ahead);
    next();
    detect_ahead();
  }
  SECTION("with too one_position or too many expected positions") {
    std::vector<double> many = sheets.scene.end;
    many.resize(many.size() + 3);
    detector.detect_ahead(start(), {many.data(), many.size() / 3}, 0.001);
    if (is_done) wait_until_ahead_is_done(both.threads);
    CHECK(!both.compare(sheets.scene).started_ahead);
    detector.detect_ahead({many.data(), 1}, {many.data(), 1}, 0.001);
  }
  SECTION("with an invalid tolerance") {
    for (const double tolerance : {-1.0, std::numeric_limits<double>::quiet_NaN(),
                                   std::numeric_limits<double>::infinity(), 1e300}) {
      detector.detect_ahead(start(), end(), tolerance);
      if (is_done) wait_until_ahead_is_done(both.threads);
      CHECK(!both.compare(sheets.scene).started_ahead);
    }
    detector.detect_ahead(start(), end(), 0);
    if (is_done) wait_until_ahead_is_done(both.threads);
    CHECK((both.compare(sheets.scene).started_ahead || !is_done));
  }
  both.compare(sheets.scene);
  next();
  detect_ahead();
  both.compare(sheets.scene);
}

TEST_CASE("sorted contacts are merged into others in order") {
  std::mt19937 random(4);
  for (int round = 0; round < 200; ++round) {
    const int count = round < 100 ? static_cast<int>(random() % 4) : 50;
    const unsigned share = random() % 4;  // one of share + 1 contacts is merged in
    std::vector<Contact> all, sorted, more;
    for (int i = 0; i < count; ++i) {
      Contact contact{};
      contact.body_a = i / 10;
      contact.primitive_b = i % 10;
      contact.toi = i;
      all.push_back(contact);
      (random() % (share + 1) == 0 ? more : sorted).push_back(contact);
    }
    merge(more, ContactOrder{nullptr}, sorted);
    CHECK(same_contacts(sorted, all));
  }
}
