// Whole detections on real frames. The true contacts were decided exactly with Mathematica.
#include <algorithm>
#include <cstdio>

#include "io/mesh.h"
#include "lazyccd/detector.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/frames.h"

using namespace lazyccd;

namespace {

// `true_vf`, `true_ee`: numbers of true contacts, published with the frames.
void check_scene(const char* scene, std::size_t true_vf, std::size_t true_ee) {
  const auto data = test::data_dir();
  if (!data) return;
  const test::FramePair frames = test::read_frame_pair(*data, scene);
  REQUIRE(frames.colliding.size() == true_vf + true_ee);

  DetectorOptions options;
  options.backend = Backend::cpu;
  Detector detector(options);
  detector.set_topology(io::topology(frames.start));
  const Span<const Contact> contacts =
      detector.detect(io::positions(frames.start), io::positions(frames.end));

  std::set<test::PairKey> found;
  std::size_t false_hits = 0;
  for (const Contact& contact : contacts) {
    CHECK(found.insert(test::key_of(contact)).second);
    false_hits += frames.colliding.count(test::key_of(contact)) == 0;
  }
  std::size_t missed = 0;
  for (const test::PairKey& key : frames.colliding) missed += found.count(key) == 0;
  std::printf("%s: %zu contacts, %zu missed, %zu false hits\n", scene, contacts.size(), missed,
              false_hits);
  CHECK(missed == 0);
  CHECK(false_hits == 0);
  CHECK(std::is_sorted(contacts.begin(), contacts.end()));
  CHECK(contact_hash(contacts) == detector.stats().hash);

  const std::vector<Edge> edges = test::unique_edges(frames.start.faces);
  CHECK(std::equal(edges.begin(), edges.end(), detector.edges().begin(), detector.edges().end()));
}

}  // namespace

TEST_CASE("on cloth-ball every true contact is found once and no other contact") {
  check_scene("cloth-ball", 19032, 94822);
}

TEST_CASE("on cloth-funnel every true contact is found once and no other contact") {
  check_scene("cloth-funnel", 27, 107);
}

TEST_CASE("on armadillo-rollers every true contact is found once and no other contact") {
  check_scene("armadillo-rollers", 4650, 19308);
}
