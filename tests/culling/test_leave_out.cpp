// Detector::leave_out(): pairs of edges and vertices that need no answer.
#include <algorithm>

#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "support/catch.h"
#include "support/moving_triangles.h"
#include "support/same_contacts.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

DetectorOptions options(int threads, bool reduced) {
  DetectorOptions result;
  result.backend = Backend::cpu;
  result.threads = threads;
  result.separation = 0.03;
  result.reduce_contacts = reduced;
  return result;
}

// Every third edge and every fourth vertex.
struct LeftOut {
  std::vector<char> edges, vertices;

  explicit LeftOut(const Detector& detector, std::size_t vertex_count)
      : edges(detector.edges().size()), vertices(vertex_count) {
    for (std::size_t e = 0; e < edges.size(); ++e) edges[e] = e % 3 == 0;
    for (std::size_t v = 0; v < vertices.size(); ++v) vertices[v] = v % 4 == 0;
  }
  bool has(const Contact& contact) const {
    return contact.kind == ContactKind::vertex_face
               ? vertices[contact.primitive_a] != 0
               : edges[contact.primitive_a] != 0 || edges[contact.primitive_b] != 0;
  }
};

}  // namespace

TEST_CASE("a detection has all contacts but those of the edges and vertices that are left out") {
  const int threads = GENERATE(1, 3);
  const MovingTriangles scene = layers(3, 8, 0.025);
  const Positions start = scene.at(scene.start), end = scene.at(scene.end);
  Detector detector(options(threads, false));
  detector.set_topology(scene.topology());
  const LeftOut left_out(detector, scene.start.size() / 3);
  const Span<const Contact> found = detector.detect(start, end);
  const std::vector<Contact> all(found.begin(), found.end());
  std::vector<Contact> expected = all;
  expected.erase(std::remove_if(expected.begin(), expected.end(),
                                [&](const Contact& contact) { return left_out.has(contact); }),
                 expected.end());
  CHECK(expected.size() > 100);
  CHECK(all.size() > expected.size() + 100);

  detector.leave_out(left_out.edges, left_out.vertices);
  CHECK(same_contacts(detector.detect(start, end), expected));
  CHECK(detector.stats().hash == contact_hash(expected));
  CHECK(detector.stats().near_pairs == static_cast<std::int64_t>(expected.size()));
  // Again with a Verlet list or a front, if the detector has one by now.
  for (int i = 0; i < 3; ++i) CHECK(same_contacts(detector.detect(start, end), expected));

  detector.leave_out({}, {});
  CHECK(same_contacts(detector.detect(start, end), all));
  detector.leave_out(left_out.edges, left_out.vertices);
  detector.set_topology(scene.topology());
  CHECK(same_contacts(detector.detect(start, end), all));
}

TEST_CASE("what cannot be left out is refused") {
  const MovingTriangles scene = layers(2, 4, 0.025);
  Detector detector(options(1, false)), touching(DetectorOptions{});
  detector.set_topology(scene.topology());
  touching.set_topology(scene.topology());
  const std::vector<char> few(3);
  CHECK_THROWS_AS(detector.leave_out(few, {}), Error);
  CHECK_THROWS_AS(detector.leave_out({}, few), Error);
  CHECK_THROWS_AS(touching.leave_out({}, {}), Error);
}
