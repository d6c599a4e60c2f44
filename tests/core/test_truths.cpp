// Compares the oracle, the exact stage and the narrow phase with the truths of the test data.
#include <cmath>
#include <cstdio>

#include "cpu/narrow/exact.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/oracle.h"
#include "support/truth_sets.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr double time_step = 0x1p-32;
constexpr double digits = 1e-16;  // precision of the times in the truth files

void check_oracle(const TruthSet& set) {
  int wrong = 0, other_time = 0, other_regularity = 0;
  for (std::size_t i = 0; i < set.points.size(); ++i) {
    const Truth truth = find_truth(set.kind, set.points[i]);
    wrong += truth.hit() != set.hit[i];
    if (set.toi.empty()) continue;
    other_regularity += static_cast<int>(truth.regularity()) != set.regularity[i];
    if (truth.hit()) other_time += !(std::fabs(truth.toi() - set.toi[i]) <= digits);
  }
  INFO(set.name);
  CHECK(wrong == 0);
  CHECK(other_time == 0);
  CHECK(other_regularity == 0);
}

template <class Decide>
void check_decisions(const TruthSet& set, Decide decide_query) {
  int missed = 0, false_hits = 0, late = 0, early = 0;
  for (std::size_t i = 0; i < set.points.size(); ++i) {
    const QueryResult result = decide_query(set.kind, set.points[i]);
    missed += set.hit[i] && !result.hit;
    false_hits += !set.hit[i] && result.hit;
    if (set.toi.empty() || !set.hit[i] || !result.hit) continue;
    late += result.toi > set.toi[i] + digits;
    early += result.toi + time_step < set.toi[i] - digits;
  }
  INFO(set.name);
  CHECK(missed == 0);
  CHECK(false_hits == 0);
  CHECK(late == 0);
  CHECK(early == 0);
}

template <class Read, class Check>
void for_each_set(Read read, Check check) {
  const auto data = data_dir();
  if (!data) return;
  for (const TruthSet& set : read(*data)) check(set);
}

QueryResult narrow_phase(ContactKind kind, const QueryPoints& points) {
  return decide(kind, points);
}

}  // namespace

TEST_CASE("the oracle agrees with every truth of the query sets") {
  for_each_set(read_query_truths, check_oracle);
}

TEST_CASE("the oracle agrees with every truth of the frames") {
  for_each_set(read_frame_truths, check_oracle);
}

TEST_CASE("the exact stage agrees with every truth of the query sets") {
  for_each_set(read_query_truths, [](const TruthSet& set) { check_decisions(set, decide_exact); });
}

TEST_CASE("the exact stage agrees with every truth of the frames") {
  for_each_set(read_frame_truths, [](const TruthSet& set) { check_decisions(set, decide_exact); });
}

TEST_CASE("the narrow phase agrees with every truth of the query sets") {
  for_each_set(read_query_truths, [](const TruthSet& set) { check_decisions(set, narrow_phase); });
}

TEST_CASE("the narrow phase agrees with every truth of the frames") {
  for_each_set(read_frame_truths, [](const TruthSet& set) { check_decisions(set, narrow_phase); });
}
