// The detector's answers do not depend on the floating-point mode of the calling thread.
#include <cfenv>
#include <cstdint>
#include <vector>

#include "core/ieee_arithmetic.h"
#include "lazyccd/detector.h"
#include "lazyccd/query.h"
#include "models/model.h"
#include "support/catch.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

using namespace lazyccd;

namespace {

// Runs `body` with each mode that applications set, and restores the mode.
template <class Body>
void in_other_modes(const Body& body) {
  std::fenv_t own;
  std::fegetenv(&own);
  for (int rounding : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    std::fesetround(rounding);
    if (std::fegetround() != rounding) {
      WARN("skipped: WebAssembly always rounds to nearest");
      return;
    }
    body();
    std::fesetenv(&own);
  }
#if defined(__SSE2__)
  _mm_setcsr(_mm_getcsr() | 0x8040);  // denormals are flushed to zero
  body();
  std::fesetenv(&own);
#endif
}

}  // namespace

TEST_CASE("products are rounded before they are added, and denormals are kept") {
  CHECK(has_ieee_arithmetic());
}

TEST_CASE("a wrong mode of the thread is noticed, mended in a scope, and restored") {
  in_other_modes([] {
    const bool before = has_ieee_arithmetic();
    bool inside = false;
    {
      const IeeeArithmetic ieee;
      inside = has_ieee_arithmetic();
    }
    const bool after = has_ieee_arithmetic();
    const IeeeArithmetic ieee;
    CHECK_FALSE(before);
    CHECK(inside);
    CHECK_FALSE(after);
  });
}

TEST_CASE("contacts do not depend on the mode of the calling thread") {
  const auto model = models::make_model("cloud-1024");
  const std::vector<float> start = model->frame(10), end = model->frame(11);
  const auto hash = [&] {
    // Threads that start in the mode of the caller.
    const Threads threads(2);
    threads.parallel_for(1000, 1, [](std::size_t, std::size_t) {});
    DetectorOptions options;
    options.backend = Backend::cpu;
    options.separation = 1e-3;
    Detector detector(options, threads);
    detector.set_topology(model->topology());
    const Positions from(start.data(), model->vertex_count()),
        to(end.data(), model->vertex_count());
    return contact_hash(detector.detect(from, to));
  };
  const std::uint64_t expected = hash();
  REQUIRE(expected != 0);
  in_other_modes([&] {
    const std::uint64_t found = hash();
    const IeeeArithmetic ieee;
    CHECK(found == expected);
  });
}

TEST_CASE("a single query does not depend on the mode of the calling thread") {
  // Edges that miss each other by a denormal distance.
  constexpr double tiny = 1e-310;
  const QueryPoints points = {{{-1, 0, 0},
                               {1, 0, 0},
                               {0, tiny, -1},
                               {0, tiny, 1},
                               {-1, 0, 0},
                               {1, 0, 0},
                               {0, 2 * tiny, -1},
                               {0, 2 * tiny, 1}}};
  REQUIRE_FALSE(decide(ContactKind::edge_edge, points).hit);
  in_other_modes([&] {
    const bool hit = decide(ContactKind::edge_edge, points).hit;
    const IeeeArithmetic ieee;
    CHECK_FALSE(hit);
  });
}

#if defined(__GLIBC__) && defined(__SSE2__)
TEST_CASE("traps of the calling thread do not reach the detector") {
  const auto model = models::make_model("cloud-1024");
  const std::vector<float> start = model->frame(10), end = model->frame(11);
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.separation = 1e-3;
  options.threads = 1;
  Detector detector(options);
  detector.set_topology(model->topology());
  std::fenv_t own;
  std::fegetenv(&own);
  feenableexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
  const std::size_t count =
      detector.detect({start.data(), model->vertex_count()}, {end.data(), model->vertex_count()})
          .size();
  const int traps = fegetexcept();
  std::fesetenv(&own);
  CHECK(count > 0);
  CHECK(traps == (FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW));
}
#endif
