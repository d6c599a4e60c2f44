// Whole detections on generated queries, regular and degenerate. They must find exactly the
// contacts of exact arithmetic, at the same times.
#include <cmath>
#include <map>
#include <string_view>
#include <vector>

#include "cpu/narrow/exact.h"
#include "lazyccd/detector.h"
#include "lazyccd/query.h"
#include "support/catch.h"
#include "support/frames.h"
#include "support/generators.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// Pairs of a triangle and a rope of one edge. Each pair has its own collision group, so that 32
// pairs, the number of bits of a mask, can be in one scene without collisions between them.
constexpr int pairs = 32;
constexpr int vertices_a_pair = 5;  // three of the triangle, then two of the rope

struct GeneratedScene {
  std::vector<std::array<double, 3>> start, end;
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<std::int32_t> body_of_vertex;
  std::vector<Body> bodies;

  Topology topology() const {
    Topology t;
    t.vertex_count = start.size();
    t.faces = faces;
    t.edges = edges;
    t.body_of_vertex = body_of_vertex;
    t.bodies = bodies;
    return t;
  }
};

// Reflects a at the midpoint of bc. The result has the scale of the query. Returns b on overflow.
std::array<double, 3> fifth_point(const std::array<double, 3>& a, const std::array<double, 3>& b,
                                  const std::array<double, 3>& c) {
  std::array<double, 3> p;
  for (std::size_t k = 0; k < 3; ++k) p[k] = b[k] - a[k] + c[k];
  return std::isfinite(p[0] + p[1] + p[2]) ? p : b;
}

// A query has four points. The fifth is the other end of the rope (vertex-face) or the third vertex
// of the triangle (edge-edge).
GeneratedScene make_scene(const Generator& generator, ContactKind kind, std::uint64_t first) {
  GeneratedScene scene;
  const bool vf = kind == ContactKind::vertex_face;
  for (int pair = 0; pair < pairs; ++pair) {
    const std::uint64_t number = first + static_cast<std::uint64_t>(pair);
    const QueryPoints q = generate(generator, kind, 5, number);
    using Order = std::array<std::size_t, 5>;
    const Order order = vf ? Order{1, 2, 3, 0, 4} : Order{2, 3, 4, 0, 1};  // 4: the fifth
    for (const std::size_t i : order) {
      scene.start.push_back(i < 4 ? q[i] : fifth_point(q[0], q[1], q[2]));
      scene.end.push_back(i < 4 ? q[i + 4] : fifth_point(q[4], q[5], q[6]));
    }
    const std::int32_t v = vertices_a_pair * pair;
    scene.faces.push_back({v, v + 1, v + 2});
    scene.edges.push_back({v + 3, v + 4});
    for (int i = 0; i < vertices_a_pair; ++i)
      scene.body_of_vertex.push_back(2 * pair + (i < 3 ? 0 : 1));
    Body body;
    body.group = body.mask = std::uint32_t{1} << pair;
    body.self_collision = false;
    scene.bodies.insert(scene.bodies.end(), 2, body);
  }
  return scene;
}

// Time of every contact. Each pair is decided alone; in exact arithmetic if the separation is 0.
std::map<PairKey, double> contacts_one_by_one(const GeneratedScene& scene, double separation) {
  std::map<PairKey, double> contacts;
  const auto decide_pair = [&](ContactKind kind, std::array<std::int32_t, 4> vertices) {
    QueryPoints points;
    for (std::size_t i = 0; i < 4; ++i) {
      points[i] = scene.start[static_cast<std::size_t>(vertices[i])];
      points[i + 4] = scene.end[static_cast<std::size_t>(vertices[i])];
    }
    const QueryResult result =
        separation > 0 ? decide_within(kind, points, separation) : decide_exact(kind, points);
    if (result.hit) contacts[key_of(kind, vertices)] = result.toi;
  };
  for (std::int32_t v = 0; v < vertices_a_pair * pairs; v += vertices_a_pair) {
    decide_pair(ContactKind::vertex_face, {v + 3, v, v + 1, v + 2});
    decide_pair(ContactKind::vertex_face, {v + 4, v, v + 1, v + 2});
    // Vertices in the order of Contact: with a separation, the last bit of the time may depend on
    // it.
    decide_pair(ContactKind::edge_edge, {v, v + 1, v + 3, v + 4});
    decide_pair(ContactKind::edge_edge, {v + 1, v + 2, v + 3, v + 4});
    decide_pair(ContactKind::edge_edge, {v, v + 2, v + 3, v + 4});
  }
  return contacts;
}

// The largest extent of the first triangle along an axis.
double size_of(const GeneratedScene& scene) {
  double size = 0;
  for (std::size_t i = 1; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      size = std::fmax(size, std::fabs(scene.start[i][k] - scene.start[0][k]));
  return size;
}

// `separation`: as a fraction of size_of() the scene.
void check_detections(Arithmetic arithmetic, double separation) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.threads = 1;
  options.algorithm.arithmetic = arithmetic;
  for (const Generator& generator : generators()) {
    // The scene is scaled otherwise than a single query. Without underflow this changes no bit;
    // tiny queries underflow.
    if (separation > 0 && generator.name == std::string_view("tiny")) continue;
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      const std::uint64_t scenes = generator.share == 1 ? 1 : repetitions(8);
      for (std::uint64_t i = 0; i < scenes; ++i) {
        INFO(generator.name << ", "
                            << (kind == ContactKind::vertex_face ? "vertex-face" : "edge-edge")
                            << ", scene " << i);
        const GeneratedScene scene = make_scene(generator, kind, i * pairs);
        options.separation = separation * size_of(scene);
        if (!(options.separation < 1e100)) continue;
        Detector detector(options);
        detector.set_topology(scene.topology());
        std::map<PairKey, double> found;
        for (const Contact& contact :
             detector.detect(Positions(scene.start[0].data(), scene.start.size()),
                             Positions(scene.end[0].data(), scene.end.size()))) {
          found[key_of(contact)] = contact.toi;
          const double length2 = contact.normal[0] * contact.normal[0] +
                                 contact.normal[1] * contact.normal[1] +
                                 contact.normal[2] * contact.normal[2];
          const bool placed = contact.u >= 0 && contact.u <= 1 && contact.v >= 0 &&
                              contact.v <= 1 && std::fabs(length2 - 1) < 1e-5;
          // Differences of "any_bits" may overflow.
          if (!placed && generator.name != std::string_view("any_bits")) CHECK(placed);
        }
        const bool same = found == contacts_one_by_one(scene, options.separation);
        CHECK(same);
      }
    }
  }
}

}  // namespace

TEST_CASE(
    "a detection finds exactly the contacts of generated scenes with single precision first") {
  check_detections(Arithmetic::single_first, 0);
}

TEST_CASE("a detection finds exactly the contacts of generated scenes in double precision") {
  check_detections(Arithmetic::double_only, 0);
}

TEST_CASE("a detection finds exactly the pairs that come within the minimum separation") {
  check_detections(Arithmetic::single_first, 1e-3);
  check_detections(Arithmetic::double_only, 0.3);
}
