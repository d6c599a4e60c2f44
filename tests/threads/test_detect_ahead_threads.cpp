// Detector::detect_ahead() on several threads. The caller interrupts it at random moments by calls
// of all kinds.
#include <chrono>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "lazyccd/detector.h"
#include "support/catch.h"
#include "support/sheets_ahead.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// Spins, sleeps or does not wait, for up to about the duration of a detection ahead.
void wait_a_little(std::mt19937& random) {
  const auto time = std::chrono::microseconds(random() % 1500);
  switch (random() % 4) {
    case 0:
      return;
    case 1:
      return std::this_thread::sleep_for(time);
    default:
      for (const auto start = std::chrono::steady_clock::now();
           std::chrono::steady_clock::now() - start < time;)
        continue;
  }
}

}  // namespace

TEST_CASE("a detection finds the same contacts whenever it interrupts the detection ahead") {
  const Strategy strategy =
      GENERATE(Strategy::thread_per_query, Strategy::task_stealing, Strategy::guided,
               Strategy::lazy_stealing_greedy, Strategy::lazy_stealing);
  const int threads = GENERATE(4, 2);
  CAPTURE(name(strategy), threads);
  DetectorOptions options = with_separation(Sheets::separation, threads);
  options.algorithm.strategy = strategy;
  options.algorithm.front = strategy == Strategy::lazy_stealing ? FrontUse::on : FrontUse::off;
  options.reduce_contacts = threads == 2;
  DetectorPair both(options);
  Sheets sheets(12);
  both.set_topology(sheets.scene.topology());
  std::mt19937 random(static_cast<unsigned>(threads));
  for (std::uint64_t step = 0; step < repetitions(120); ++step) {
    const Expectation expectation = step % 7 == 6 ? Expectation::beyond : Expectation::within;
    sheets.move(expectation);
    both.with.detect_ahead(sheets.scene.at(sheets.expected_start),
                           sheets.scene.at(sheets.expected_end), Sheets::tolerance);
    wait_a_little(random);
    CAPTURE(step);
    both.compare(sheets.scene);
  }
}

TEST_CASE("a detection ahead can be interrupted by any call at any moment") {
  DetectorOptions options = with_separation(Sheets::separation, 3);
  auto both = std::make_unique<DetectorPair>(options);
  Sheets sheets(12);
  both->set_topology(sheets.scene.topology());
  std::mt19937 random(6);
  for (std::uint64_t step = 0; step < repetitions(250); ++step) {
    sheets.move(Expectation::within);
    const auto detect_ahead = [&] {
      both->with.detect_ahead(sheets.scene.at(sheets.expected_start),
                              sheets.scene.at(sheets.expected_end), Sheets::tolerance);
      wait_a_little(random);
    };
    detect_ahead();
    switch (random() % 6) {
      case 0:
        detect_ahead();
        break;
      case 1:
        sheets.scene.faces.pop_back();
        both->set_topology(sheets.scene.topology());
        break;
      case 2:
        both = std::make_unique<DetectorPair>(options);
        both->set_topology(sheets.scene.topology());
        detect_ahead();
        break;
      case 3: {
        std::vector<int> calls(3000);  // not atomic: the parts are disjoint
        both->threads.parallel_for(calls.size(), 10, [&](std::size_t first, std::size_t last) {
          for (std::size_t i = first; i < last; ++i) ++calls[i];
        });
        CHECK(calls == std::vector<int>(3000, 1));
        break;
      }
      default:
        break;
    }
    CAPTURE(step);
    both->compare(sheets.scene);
  }
}
