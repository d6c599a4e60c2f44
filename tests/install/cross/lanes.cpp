// Decides random queries by the float filter, one by one or in lanes, for counting instructions:
//
//   lanes one COUNT     with single numbers
//   lanes many COUNT    with lanes; COUNT is a multiple of 16, at most 4096
//
// Prints a hash of the verdicts, which is the same for both.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <vector>

#include "core/narrow/roots.h"
#include "cpu/isa/float_lanes.h"

namespace lazyccd {
namespace LAZYCCD_ISA {
namespace {

constexpr int numbers = 18;         // three vectors at both ends of the step
constexpr int most_queries = 4096;  // these are made whatever the count is

template <class T>
Differences<T> differences(const T (&x)[numbers]) {
  Differences<T> d;
  int next = 0;
  for (Vec3<T>(*v)[2] : {&d.e1, &d.e2, &d.r})
    for (Vec3<T>& end : *v) {
      end = {x[next], x[next + 1], x[next + 2]};
      next += 3;
    }
  return d;
}

template <class T>
__attribute__((noinline)) Verdict<T> decide(const T (&x)[numbers]) {
  const Differences<T> d = differences(x);
  const Magnitudes<T> m = magnitudes(d);
  return decide_at_roots<ContactKind::vertex_face>(d, m, coplanarity(d, m));
}

int run(bool lanes, int count) {
  std::minstd_rand random(1);
  std::vector<float> values(numbers * most_queries);
  for (float& x : values) x = static_cast<float>(random() % 2001) / 1000 - 1;
  std::uint64_t hash = 0;
  const auto add = [&](int query, bool hit, bool miss) {
    hash += static_cast<std::uint64_t>(query) * (hit ? 3 : miss ? 5 : 7);
  };
  const auto number = [&](int k, int i) {
    return &values[static_cast<std::size_t>(k * most_queries + i)];
  };
  for (int i = 0; i < count; i += lanes ? FloatLanes::lanes : 1) {
    if (lanes) {
      FloatLanes x[numbers];
      for (int k = 0; k < numbers; ++k) std::memcpy(&x[k], number(k, i), sizeof x[k]);
      const Verdict<FloatLanes> verdict = decide(x);
      const unsigned hits = verdict.hit.bits(), misses = verdict.miss.bits();
      for (int j = 0; j < FloatLanes::lanes; ++j) add(i + j, hits >> j & 1, misses >> j & 1);
    } else {
      float x[numbers];
      for (int k = 0; k < numbers; ++k) x[k] = *number(k, i);
      const Verdict<float> verdict = decide(x);
      add(i, verdict.hit, verdict.miss);
    }
  }
  std::printf("%016llx\n", static_cast<unsigned long long>(hash));
  return 0;
}

}  // namespace
}  // namespace LAZYCCD_ISA
}  // namespace lazyccd

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  return lazyccd::LAZYCCD_ISA::run(!std::strcmp(argv[1], "many"), std::atoi(argv[2]));
}
