// Contact reduction reports one of several near pairs with the same closest points. Pairs within a
// body are reported up to its self-separation.
#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/narrow/start_distance.h"
#include "cpu/cpu_detector.h"
#include "host/scene/positions.h"
#include "host/scene/scale.h"
#include "host/threads/thread_pool.h"
#include "isa/named_kernels.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "lazyccd/query.h"
#include "support/catch.h"
#include "support/moving_triangles.h"
#include "support/same_contacts.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr double separation = 0.3;  // edges have length 1

// A wavy square cloth of `side` x `side` nodes at height `z`, that moves down by `down`.
void add_cloth(int side, double z, double shift, double down, MovingTriangles& scene) {
  const auto first = static_cast<std::int32_t>(scene.start.size() / 3);
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const double x[3] = {i + shift, j + 0.5 * shift, z + 0.05 * std::sin(i + 2 * j)};
      for (int k = 0; k < 3; ++k) {
        scene.start.push_back(x[k]);
        scene.end.push_back(x[k] - (k == 2 ? down : 0.01 * (i + j)));
      }
    }
  }
  for (int i = 0; i + 1 < side; ++i) {
    for (int j = 0; j + 1 < side; ++j) {
      const std::int32_t a = first + i * side + j, b = a + side;
      scene.faces.push_back({a, b, b + 1});
      scene.faces.push_back({a, b + 1, a + 1});
    }
  }
}

// Four cloths, with vertices above vertices, above edges and above faces.
MovingTriangles cloths() {
  MovingTriangles scene;
  add_cloth(9, 0, 0, 0, scene);
  add_cloth(7, 0.2, 0, 0.1, scene);
  add_cloth(5, 0.36, 0.5, 0.05, scene);
  add_cloth(4, 0.8, 0.3, 0.7, scene);
  return scene;
}

DetectorOptions cpu_options(bool reduced) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.separation = separation;
  options.reduce_contacts = reduced;
  return options;
}

std::vector<Contact> near(const MovingTriangles& scene, const DetectorOptions& options) {
  Detector detector(options);
  detector.set_topology(scene.topology());
  const Span<const Contact> found = detector.detect(scene.at(scene.start), scene.at(scene.end));
  return {found.begin(), found.end()};
}

// What a device makes of all contacts, with the same functions: one after the other, as scalars.
struct AsOnDevice {
  std::vector<Contact> kept;
  std::vector<double> distances;  // by body
  std::array<std::vector<Candidate>, 2> pairs;

  AsOnDevice(const std::vector<Contact>& all, const Topology& topology, const Positions& start,
             const Positions& end)
      : mesh_(topology) {
    distances.assign(mesh_.body_count(), HUGE_VAL);
    std::vector<VertexRecord> records;
    ThreadPool pool(1);
    const double scale = scale_for(load_records(mesh_, start, end, pool, records));
    for (const Contact& contact : all) {
      const bool is_redundant = contact.kind == ContactKind::vertex_face
                                    ? record<ContactKind::vertex_face>(contact, records, scale)
                                    : record<ContactKind::edge_edge>(contact, records, scale);
      if (!(is_redundant && contact.toi == 0)) kept.push_back(contact);
    }
  }

 private:
  template <ContactKind kind>
  bool record(const Contact& contact, const std::vector<VertexRecord>& records, double scale) {
    QueryCoordinates q;
    for (int i = 0; i < 4; ++i) {
      const double* const x = records[contact.vertices[i]].x;
      q.start[i] = {x[0], x[1], x[2]};
    }
    const Candidate pair = {contact.primitive_a, contact.primitive_b};
    pairs[static_cast<std::size_t>(kind)].push_back(pair);
    const DifferencesAt<float> d = differences_at_start<kind>(q, scale);
    const StartDistance<float> at_start = start_distance<kind>(d);
    const double distance = at_start.gap.template min_distance<kind>(d) / scale;
    for (const std::int32_t body : {contact.body_a, contact.body_b})
      distances[body] = std::min(distances[body], distance);
    return is_redundant_at_start<kind>(mesh_.view(), mesh_.first_faces(),
                                       {separation, mesh_.self_separation()}, scale, pair,
                                       at_start);
  }

  Mesh mesh_;
};

double gap_at_start(const Contact& contact, const MovingTriangles& scene) {
  double squared = 0;
  const std::array<double, 4> weights = contact.weights();
  for (int k = 0; k < 3; ++k) {
    double sum = 0;
    for (int i = 0; i < 4; ++i) sum += weights[i] * scene.start[3 * contact.vertices[i] + k];
    squared += sum * sum;
  }
  return std::sqrt(squared);
}

QueryPoints points_of(const Contact& contact, const MovingTriangles& scene) {
  QueryPoints points;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      points[i][k] = scene.start[3 * contact.vertices[i] + k];
      points[4 + i][k] = scene.end[3 * contact.vertices[i] + k];
    }
  }
  return points;
}

// Topology::self_separation of a pair, as its documentation says.
double own_separation(const Contact& contact, const std::vector<float>& of_vertex) {
  if (contact.body_a != contact.body_b) return separation;
  const int split = contact.kind == ContactKind::vertex_face ? 1 : 2;
  float limits[2] = {0, 0};
  for (int i = 0; i < 4; ++i)
    limits[i >= split] = std::max(limits[i >= split], of_vertex[contact.vertices[i]]);
  const double limit = std::min(limits[0], limits[1]);
  return std::min(separation, std::max(limit, 0x1p-10 * separation));
}

// The vertices whose weight in the contact is not about zero.
std::vector<std::int32_t> bearing(const Contact& contact) {
  std::vector<std::int32_t> vertices;
  for (int i = 0; i < 4; ++i)
    if (std::fabs(contact.weights()[i]) > 0.002) vertices.push_back(contact.vertices[i]);
  return vertices;
}

// Checks that each contact that is not reported has a reported one at its points.
void check_represented(const std::vector<Contact>& all, const std::vector<Contact>& reported,
                       const MovingTriangles& scene) {
  CHECK(std::includes(all.begin(), all.end(), reported.begin(), reported.end()));
  int unrepresented = 0, late = 0;
  for (const Contact& contact : all) {
    if (std::binary_search(reported.begin(), reported.end(), contact)) continue;
    late += contact.toi > 0;
    const std::vector<std::int32_t> vertices = bearing(contact);
    const auto stands_for = [&](const Contact& other) {
      const auto has = [&](std::int32_t v) {
        return std::count(other.vertices.begin(), other.vertices.end(), v) > 0;
      };
      return other.kind == ContactKind::vertex_face &&
             std::any_of(vertices.begin(), vertices.end(), has) &&
             gap_at_start(other, scene) <= gap_at_start(contact, scene) + 0.002;
    };
    unrepresented += std::none_of(reported.begin(), reported.end(), stands_for);
  }
  CHECK(unrepresented == 0);
  CHECK(late == 0);
}

}  // namespace

TEST_CASE("for each contact left out a reported one shares its points and is as near") {
  const MovingTriangles scene = cloths();
  const std::vector<Contact> all = near(scene, cpu_options(false)),
                             reported = near(scene, cpu_options(true));
  CHECK(reported.size() > 200);
  CHECK(all.size() > reported.size() + 1000);
  check_represented(all, reported, scene);
}
TEST_CASE("a vertex above a vertex is one contact from either side and above an edge one contact") {
  struct {
    double beside;  // offset of the vertex along x from the middle vertex
    std::size_t all, reported;
  } const cases[] = {
      // Corner with six faces, middle vertex with one face, two edges with six edges.
      {0, 6 + 1 + 2 * 6, 2},
      // Corner with two faces, two edges with one edge.
      {0.5, 2 + 2, 1},
  };
  for (const auto& expected : cases) {
    MovingTriangles scene;
    add_cloth(3, 0, 0, 0, scene);
    for (std::size_t v = 0; v < 9; ++v) scene.start[3 * v + 2] = 0;
    const double corners[3][3] = {{1, 1, 0.2}, {1.4, 1.1, 2}, {1.1, 1.4, 2}};
    for (const auto& x : corners)
      scene.start.insert(scene.start.end(), {x[0] + expected.beside, x[1], x[2]});
    scene.faces.push_back({9, 10, 11});
    scene.end = scene.start;
    CHECK(near(scene, cpu_options(false)).size() == expected.all);
    CHECK(near(scene, cpu_options(true)).size() == expected.reported);
  }
}

TEST_CASE("pairs are reported if the pair that would replace them is not near") {
  // Two edges cross near an end of one of them. The vertex of this end is beyond the separation.
  MovingTriangles scene;
  scene.start = {0, 0, 0, 1, 0, 0, 0.5, 0, -1, 0.0005, -0.5, 1e-6, 0.0005, 0.5, 1e-6, 0.0005, 0, 1};
  scene.end = scene.start;
  for (std::size_t v = 3; v < 6; ++v) scene.end[3 * v + 2] -= 5e-4;
  scene.faces = {{0, 1, 2}, {3, 4, 5}};
  DetectorOptions options = cpu_options(true);
  options.separation = 1e-5;
  for (const Arithmetic arithmetic : {Arithmetic::single_first, Arithmetic::double_only}) {
    options.algorithm.arithmetic = arithmetic;
    const std::vector<Contact> found = near(scene, options);
    REQUIRE(found.size() == 1);
    CHECK(found[0].kind == ContactKind::edge_edge);
  }
}

TEST_CASE("a pair of pinned vertices alone replaces no other pair") {
  // Two edges that share a pinned vertex, which is next to an edge of a pinned face.
  MovingTriangles scene;
  scene.start = {0, 0, 0, 1, 0, -0.5, 0.5, 0.1, -1, 0, -0.5, 0.1, 0, 0.5, 0.1, 0, 0, 1};
  scene.end = scene.start;
  scene.faces = {{0, 1, 2}, {3, 4, 5}};
  const std::vector<float> inverse_mass = {0, 1, 1, 0, 0, 0};
  Topology topology = scene.topology();
  topology.inverse_mass = {inverse_mass.data(), inverse_mass.size()};
  Detector detector(cpu_options(true));
  detector.set_topology(topology);
  CHECK(detector.detect(scene.at(scene.start), scene.at(scene.end)).size() == 2);
}

TEST_CASE("contact reduction is the same in every arithmetic, strategy and instruction set") {
  const MovingTriangles scene = cloths();
  const Mesh mesh(scene.topology());
  DetectorOptions options = cpu_options(true);
  const auto hash = [&](const LeafKernels& kernels) {
    CpuDetector detector(options, kernels);
    detector.set_mesh(mesh);
    Stats stats;
    detector.detect(scene.at(scene.start), scene.at(scene.end), stats);
    return stats.hash;
  };
  const std::uint64_t expected = hash(*leaf_kernels("baseline"));
  for (const char* name : {"plain", "avx2", "avx512"})
    if (const LeafKernels* kernels = named_kernels(name)) CHECK(hash(*kernels) == expected);
  options.algorithm.arithmetic = Arithmetic::double_only;
  CHECK(hash(*best_leaf_kernels()) == expected);
  options.threads = 1;
  options.algorithm.strategy = Strategy::thread_per_query;
  CHECK(hash(*best_leaf_kernels()) == expected);

  // Also the same on a device.
  const AsOnDevice device(near(scene, cpu_options(false)), scene.topology(), scene.at(scene.start),
                          scene.at(scene.end));
  CHECK(contact_hash(device.kept) == expected);
  CpuDetector detector(options);
  detector.set_mesh(mesh);
  detector.take_near_distances(device.distances);
  Stats again;
  CHECK_THROWS_AS(detector.recheck_near_pairs(scene.at(scene.start), scene.at(scene.end), again),
                  Error);
  detector.take_near_pairs({device.pairs[0], device.pairs[1]});
  detector.recheck_near_pairs(scene.at(scene.start), scene.at(scene.end), again);
  Detector plain;
  plain.set_topology(scene.topology());
  plain.detect(scene.at(scene.start), scene.at(scene.end));
  CHECK(again.hash == plain.stats().hash);
  CHECK(plain.stats().contacts_vf > 0);
}

TEST_CASE("the near distance of a body is that of its nearest pair, or the separation") {
  MovingTriangles scene = cloths();
  const auto of_cloths = static_cast<std::int32_t>(scene.start.size() / 3);
  // A triangle far away.
  for (std::vector<double>* positions : {&scene.start, &scene.end})
    positions->insert(positions->end(), {90, 0, 0, 91, 0, 0, 90, 1, 0});
  scene.faces.push_back({of_cloths, of_cloths + 1, of_cloths + 2});
  std::vector<std::int32_t> body(scene.start.size() / 3, 2);
  std::fill_n(body.begin(), of_cloths, 1);
  std::fill_n(body.begin(), 81, 0);
  Topology topology = scene.topology();
  topology.body_of_vertex = body;
  const Positions start = scene.at(scene.start), end = scene.at(scene.end);
  Detector everything(cpu_options(false));
  everything.set_topology(topology);
  const Span<const Contact> contacts = everything.detect(start, end);
  const double beyond = cpu_options(false).separation;
  std::vector<double> smallest(3, beyond);
  for (const Contact& contact : contacts) {
    if (contact.toi > 0) continue;
    const double gap = gap_at_start(contact, scene);
    for (const std::int32_t b : {contact.body_a, contact.body_b})
      smallest[b] = std::min(smallest[b], gap);
  }
  REQUIRE(smallest[0] < beyond);
  REQUIRE(smallest[1] < beyond);
  Detector reduced(cpu_options(true));
  reduced.set_topology(topology);
  reduced.detect(start, end);
  const Mesh mesh(topology);
  CpuDetector of_device(cpu_options(true));
  of_device.set_mesh(mesh);
  const AsOnDevice device({contacts.begin(), contacts.end()}, topology, start, end);
  of_device.take_near_distances(device.distances);
  const Span<const double> of_cpu = reduced.near_distances(), taken = of_device.near_distances();
  CHECK(std::equal(taken.begin(), taken.end(), of_cpu.begin(), of_cpu.end()));
  for (const Span<const double> distances :
       {everything.near_distances(), reduced.near_distances(), of_device.near_distances()}) {
    REQUIRE(distances.size() == 3);
    for (int b = 0; b < 2; ++b) {
      CHECK(distances[b] <= smallest[b] * (1 + 1e-5));
      CHECK(distances[b] > smallest[b] * 0.99);
    }
    CHECK(distances[2] == beyond);
  }

  // A limit bounds what is known of a body, unless the body does not collide with itself.
  std::vector<float> self_separation(body.size(), static_cast<float>(0.5 * smallest[0]));
  std::vector<Body> filters(3);
  filters[1].self_collision = false;
  topology.self_separation = self_separation;
  topology.bodies = filters;
  everything.set_topology(topology);
  everything.detect(start, end);
  const Span<const double> limited = everything.near_distances();
  CHECK(limited[0] == static_cast<double>(self_separation[0]));
  CHECK(limited[1] > limited[0]);
  CHECK(limited[2] == limited[0]);
}

TEST_CASE("the separation of a pair of one body is at most that of its vertices") {
  const MovingTriangles scene = cloths();
  const std::size_t count = scene.start.size() / 3, of_first = 81;
  std::vector<std::int32_t> body(count, 1);
  std::fill_n(body.begin(), of_first, 0);
  std::vector<float> self_separation(count);
  const float limits[] = {0.04f, 0.06f, 0.08f, 0.1f, 0.12f, 0.2f, 0.5f, 0, 1e-4f, HUGE_VALF};
  for (std::size_t v = 0; v < count; ++v) self_separation[v] = limits[v * 7 % std::size(limits)];
  Topology free = scene.topology();
  free.body_of_vertex = body;
  Topology limited = free;
  limited.self_separation = self_separation;
  const Positions start = scene.at(scene.start), end = scene.at(scene.end);
  const auto found = [&](const Topology& topology, Detector& detector) {
    detector.set_topology(topology);
    const Span<const Contact> contacts = detector.detect(start, end);
    return std::vector<Contact>(contacts.begin(), contacts.end());
  };
  Detector everything(cpu_options(false)), plain;
  const std::vector<Contact> within_separation = found(free, everything);
  const std::vector<Contact> all = found(limited, everything), touching = found(free, plain);
  REQUIRE(plain.stats().contacts_vf > 0);

  // Pair by pair, with the single test.
  std::size_t expected = 0, fewer = 0;
  for (const Contact& contact : within_separation) {
    const QueryResult result = decide_within(contact.kind, points_of(contact, scene),
                                             own_separation(contact, self_separation));
    fewer += !result.hit;
    if (!result.hit) continue;
    REQUIRE(expected < all.size());
    const Contact& reported = all[expected++];
    CHECK((!(reported < contact) && !(contact < reported)));
    CHECK(reported.toi == result.toi);
  }
  CHECK(expected == all.size());
  CHECK(fewer > 100);
  CHECK(everything.stats().near_pairs == static_cast<std::int64_t>(all.size()));
  CHECK(same_contacts(everything.recheck_near_pairs(start, end), touching));

  Detector reduced(cpu_options(true));
  const std::vector<Contact> reported = found(limited, reduced);
  CHECK(reported.size() + 100 < all.size());
  check_represented(all, reported, scene);
  CHECK(same_contacts(reduced.recheck_near_pairs(start, end), touching));
  CHECK(same_contacts(AsOnDevice(all, limited, start, end).kept, reported));

  Topology wrong = limited;
  wrong.self_separation = {self_separation.data(), count - 1};
  Detector detector;
  CHECK_THROWS_AS(detector.set_topology(wrong), Error);
  std::vector<float> negative = self_separation;
  negative[7] = -1;
  wrong.self_separation = negative;
  CHECK_THROWS_AS(detector.set_topology(wrong), Error);
}
