// Scenes for tests of Detector::detect_ahead(), and a comparison of detectors with and without it.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <random>
#include <thread>
#include <vector>

#include "lazyccd/detector.h"
#include "support/catch.h"
#include "support/moving_triangles.h"
#include "support/same_contacts.h"

namespace lazyccd::test {

/// Options of a CPU detector.
inline DetectorOptions with_separation(double separation, int threads) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.threads = threads;
  options.separation = separation;
  return options;
}

/// Waits until the second thread of two has finished the detection ahead. Only then does it process
/// parts of a parallel loop; with 8 parts, the loop wakes it even if it sleeps.
inline void wait_until_ahead_is_done(const Threads& threads) {
  const auto caller = std::this_thread::get_id();
  for (std::atomic<bool> has_come{false}; !has_come;) {
    threads.parallel_for(8, 1, [&](std::size_t, std::size_t) {
      if (std::this_thread::get_id() != caller) has_come = true;
      std::this_thread::sleep_for(std::chrono::microseconds(20));
    });
  }
}

/// As same_contacts(), and signs of zeros are equal too.
inline bool same_bits(Span<const Contact> a, Span<const Contact> b) {
  const auto same_signs = [](const Contact& x, const Contact& y) {
    bool same = std::signbit(x.u) == std::signbit(y.u) && std::signbit(x.v) == std::signbit(y.v);
    for (int k = 0; k < 3; ++k)
      same = same && std::signbit(x.normal[k]) == std::signbit(y.normal[k]);
    return same && x.vertices == y.vertices;
  };
  return same_contacts(a, b) && std::equal(a.begin(), a.end(), b.begin(), same_signs);
}

/// Two detectors of the same scene. `with` uses detect_ahead(), `without` runs on one thread.
struct DetectorPair {
  Threads threads;  // of `with`
  Detector with, without;

  explicit DetectorPair(const DetectorOptions& options)
      : threads(options.threads), with(options, threads), without(alone(options)) {}

  static DetectorOptions alone(DetectorOptions options) {
    options.threads = 1;
    return options;
  }
  void set_topology(const Topology& topology) {
    with.set_topology(topology);
    without.set_topology(topology);
  }
  /// Runs both detectors on the present step and checks that the results are equal. Returns the
  /// statistics of `with`.
  Stats compare(const MovingTriangles& scene) {
    const Positions start = scene.at(scene.start), end = scene.at(scene.end);
    const Span<const Contact> found = with.detect(start, end);
    CHECK(same_bits(found, without.detect(start, end)));
    const Stats stats = with.stats(), others = without.stats();
    CHECK(stats.hash == others.hash);
    CHECK(stats.hash == contact_hash(found));
    CHECK(stats.near_pairs == others.near_pairs);
    CHECK(stats.contacts_vf == others.contacts_vf);
    CHECK(stats.contacts_ee == others.contacts_ee);
    CHECK(same_bits(with.recheck_near_pairs(start, end), without.recheck_near_pairs(start, end)));
    return stats;
  }
};

/// How well the expectation agrees with the step: equal, within or beyond the tolerance, another
/// start, or no expectation at all.
enum class Expectation { exact, within, beyond, other_start, none };

/// Sheets that creep, shake and fly through each other, and the expectation of each step.
class Sheets {
 public:
  static constexpr double separation = 0.022, tolerance = 0.1 * separation;

  explicit Sheets(int nodes) : scene(layers(3, nodes, 0.02)), rest_(scene.start) {}

  /// Moves to the next step and sets the expected positions for detect_ahead().
  void move(Expectation expectation) {
    const std::size_t sheet_size = scene.end.size() / 3;
    scene.start = step_ % 17 == 16 ? rest_ : scene.end;
    scene.end = scene.start;
    const std::size_t flying = step_ / 5 % 3, shaking = random_() % (scene.end.size() - 30);
    const double fly = step_ % 4 == 3 ? 0.2 * (step_ / 5 % 2) : 0.002 * symmetric();
    for (std::size_t i = 0; i < scene.end.size(); ++i) {
      if (i / sheet_size == flying) scene.end[i] += fly;
      if (step_ % 2 == 0 && i - shaking < 30) scene.end[i] += 0.02 * symmetric();
      scene.end[i] += 1e-4 * symmetric();
    }
    ++step_;
    expected_start = scene.start;
    expected_end = scene.end;
    if (expectation == Expectation::within || expectation == Expectation::beyond) {
      const double by = (expectation == Expectation::within ? 0.57 : 3) * tolerance;
      for (double& x : expected_end)
        x += by * (step_ % 3 == 0 ? (random_() % 2 ? 1 : -1) : symmetric());
    }
    if (expectation == Expectation::other_start) {
      double& x = expected_start[random_() % expected_start.size()];
      x = std::nextafter(x, 1.0);
    }
  }

  /// The present step.
  MovingTriangles scene;
  std::vector<double> expected_start, expected_end;

 private:
  double symmetric() { return random_() / 2147483648.0 - 1; }

  std::vector<double> rest_;
  std::mt19937 random_{8};
  int step_ = 0;
};

}  // namespace lazyccd::test
