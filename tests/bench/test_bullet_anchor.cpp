// The reference of the benchmarks must be Bullet's own detection with its faults. Otherwise ratios
// to it mean nothing.
#include <algorithm>

#include "bench/bullet/process.h"
#include "bench/frames.h"
#include "lazyccd/detector.h"
#include "support/catch.h"
#include "support/data.h"

using namespace lazyccd;
using bench::BulletPrecision;
using bench::BulletProcess;

namespace {

bench::Pairs bullet_contacts(const bench::FramePair& pair, BulletPrecision precision) {
  BulletProcess process(precision);
  process.set_mesh(io::positions(pair.start), io::positions(pair.end), pair.start.faces);
  CHECK(process.pass() > 0);
  return process.contacts();
}

bench::Pairs lazyccd_contacts(const bench::FramePair& pair) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.edge_edge = false;
  Detector detector(options);
  detector.set_topology(io::topology(pair.start));
  bench::Pairs pairs;
  for (const Contact& c : detector.detect(io::positions(pair.start), io::positions(pair.end)))
    pairs.push_back({c.primitive_a, c.primitive_b});
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace

TEST_CASE("Bullet's pass ends on a mesh of several components and finds most contacts in double") {
  const bench::FramePair pair = bench::waving_sheets(48, 3);
  const bench::Pairs truth = lazyccd_contacts(pair);
  REQUIRE(truth.size() > 100);
  const bench::Pairs found = bullet_contacts(pair, BulletPrecision::double_precision);
  const bench::Difference d = bench::difference(truth, found);
  CHECK(d.missed < truth.size() / 2);
  CHECK(d.extra < truth.size() / 20);
}

TEST_CASE("a second pass over the same mesh finds the same contacts") {
  const bench::FramePair pair = bench::waving_sheets(32, 2);
  BulletProcess process(BulletPrecision::single_precision);
  process.set_mesh(io::positions(pair.start), io::positions(pair.end), pair.start.faces);
  process.pass();
  const bench::Pairs first = process.contacts();
  CHECK_FALSE(first.empty());
  process.pass();
  CHECK(process.contacts() == first);
}

TEST_CASE("Bullet misses as many contacts on real frames as is known") {
  const auto data = test::data_dir();
  if (!data) return;
  for (const bench::FramePair& pair : bench::read_frames(*data)) {
    if (pair.name != "cloth-funnel") continue;
    REQUIRE(pair.truth_vf->size() == 27);
    const auto single = bullet_contacts(pair, BulletPrecision::single_precision);
    CHECK(bench::difference(*pair.truth_vf, single).missed == 27);
    const auto twice = bullet_contacts(pair, BulletPrecision::double_precision);
    CHECK(bench::difference(*pair.truth_vf, twice).missed == 6);
  }
}
