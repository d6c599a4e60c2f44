// When untangling gives a pair of bodies up.
#include "untangling/pair_progress.h"

#include <cmath>

#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;

namespace {

// Seconds until a pair is given up, at most `limit`. depth(time) is that of its penetrations.
template <class Depth>
double seconds_until_given_up(double limit, const Depth& depth) {
  constexpr double dt = 1.0 / 60;
  PairProgress progress;
  double time = 0;
  for (; time < limit; time += dt) {
    const PairProgress::FoundPairs found = {{BodyPair{0, 1}, {20, depth(time)}}};
    if (progress.update(found, dt, {1, 0}).empty()) break;
  }
  return time;
}

}  // namespace

TEST_CASE("a pair whose depth does not fall is given up after three seconds") {
  CHECK(seconds_until_given_up(20, [](double) { return 0.1; }) == Approx(3).margin(0.1));
}

TEST_CASE("a pair that falls by two hundredths a second is given up after three seconds") {
  const auto depth = [](double time) { return 0.1 * std::pow(0.98, std::floor(time)); };
  CHECK(seconds_until_given_up(20, depth) == Approx(3).margin(0.1));
}

TEST_CASE("a pair that comes out slowly and evenly is not given up") {
  // By 6 % a second, 0.1 % a step.
  const auto depth = [](double time) { return 0.1 * std::exp(-0.06 * time); };
  CHECK(seconds_until_given_up(20, depth) >= 20);
}

TEST_CASE("a pair that gets deeper again is given up three seconds after its least depth") {
  const auto depth = [](double time) { return 0.1 + 0.05 * std::cos(2 * time); };
  CHECK(seconds_until_given_up(20, depth) == Approx(1.5 + 3).margin(0.5));
}
