// The leaf kernels of every instruction set of this machine.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <random>
#include <utility>

#include "core/narrow/contact_math.h"
#include "cpu/cpu_detector.h"
#include "isa/named_kernels.h"
#include "support/catch.h"
#include "support/moving_triangles.h"
#include "support/same_contacts.h"

using namespace lazyccd;
using namespace lazyccd::test;

TEST_CASE("the box of a vertex contains it with every instruction set and any numbers") {
  const double largest = std::numeric_limits<float>::max();
  const double values[] = {0.0,    -0.0,  1.0,    -1.0,     0.1,       -0.1,       1e-30,
                           -1e-30, 1e-46, -1e-46, 1e-300,   -1e-300,   largest,    -largest,
                           1e60,   -1e60, 1e300,  1 + 1e-9, -1 - 1e-9, 16777217.0, 3e38};
  constexpr std::size_t count = std::size(values);
  alignas(64) VertexRecord records[count];
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < 8; ++k) records[i].x[k] = k < 6 ? values[(i + 5 * k) % count] : 0;
  }
  for (const char* name : {"plain", "baseline", "avx2", "avx512"}) {
    const LeafKernels* kernels = named_kernels(name);
    if (!kernels) continue;
    for (const double margin : {0.0, 1e-3, 1e-60, 1e40}) {
      std::vector<VertexBox> boxes(count);
      kernels->box_vertices(records[0].x, 1, margin, 0, count, boxes.data());
      bool holds = true, tight = true;
      for (std::size_t i = 0; i < count; ++i) {
        for (int k = 0; k < 3; ++k) {
          for (int end = 0; end < 2; ++end) {
            const double x = records[i].x[3 * end + k];
            const double lower = static_cast<double>(-boxes[i].lower(end)[k]),
                         upper = static_cast<double>(boxes[i].upper(end)[k]);
            holds = holds && lower <= std::clamp(x - margin, -largest, largest) &&
                    upper >= std::clamp(x + margin, -largest, largest);
            const bool is_float =
                std::fabs(x) <= largest && static_cast<double>(static_cast<float>(x)) == x;
            tight = tight && (margin > 0 || !is_float || (lower == x && upper == x));
          }
        }
      }
      INFO(name << ", margin " << margin);
      CHECK(holds);
      CHECK(tight);
    }
  }
}

TEST_CASE("every instruction set finds the same contacts") {
  const MovingTriangles triangles = crowd_of_triangles(1500), cloths = layers(3, 12, 0.02);
  const struct {
    const MovingTriangles& scene;
    double separation;
    bool distinct;
    Arithmetic arithmetic;
    double limit = 0;  // of the separation within each third of the vertices; 0: none
  } cases[] = {{triangles, 0, false, Arithmetic::single_first},
               {triangles, 0.002, false, Arithmetic::single_first},
               {triangles, 0.05, true, Arithmetic::single_first},
               {triangles, 0.05, true, Arithmetic::double_only},
               {cloths, 0.022, false, Arithmetic::single_first},
               {cloths, 0.022, true, Arithmetic::single_first},
               {cloths, 0.022, true, Arithmetic::double_only},
               {cloths, 0.15, false, Arithmetic::single_first, 0.1},
               {cloths, 0.15, true, Arithmetic::single_first, 0.1},
               {cloths, 0.15, true, Arithmetic::double_only, 0.1},
               {cloths, 1e40, false, Arithmetic::single_first, 1e-3}};
  for (const auto& c : cases) {
    const SheetsAsBodies bodies(c.scene, 3, c.limit);
    const Mesh mesh(c.limit > 0 ? bodies.topology(c.scene) : c.scene.topology());
    DetectorOptions options;
    options.threads = 1;
    options.separation = c.separation;
    options.reduce_contacts = c.distinct;
    options.algorithm.arithmetic = c.arithmetic;
    const auto find = [&](const LeafKernels& kernels) {
      CpuDetector detector(options, kernels);
      detector.set_mesh(mesh);
      Stats stats;
      const Span<const Contact> found =
          detector.detect(c.scene.at(c.scene.start), c.scene.at(c.scene.end), stats);
      return std::vector<Contact>(found.begin(), found.end());
    };
    const std::vector<Contact> expected = find(*leaf_kernels("baseline"));
    CHECK(expected.size() > 200);
    for (const char* name : {"plain", "avx2", "avx512"}) {
      INFO(name << ", separation " << c.separation << ", distinct " << c.distinct);
      if (const LeafKernels* kernels = named_kernels(name))
        CHECK(same_contacts(find(*kernels), expected));
    }
  }
}

TEST_CASE("pairs at about the separation are near in every arithmetic or in none") {
  const bool within_body = GENERATE(false, true);
  constexpr double separation = 0.004, size = 4, room = 20;
  // Pairs of triangles, one above the other. Their distance is the separation, but for some
  // rounding errors of single precision.
  MovingTriangles scene;
  std::mt19937 random(17);
  const auto symmetric = [&] { return random() / 2147483648.0 - 1; };
  const auto any = [&] { return Vec3<double>{symmetric(), symmetric(), symmetric()}; };
  const auto unit = [](const Vec3<double>& v) { return (1 / std::sqrt(dot(v, v))) * v; };
  for (int pair = 0; pair < 1000; ++pair) {
    const Vec3<double> place = room * any(), along = unit(any()), up = unit(cross(along, any())),
                       across = cross(up, along);
    const double gap = separation * (1 + 1e-5 * (pair % 41 - 20));
    for (const double height : {0.0, gap}) {
      const auto vertex = static_cast<std::int32_t>(scene.start.size() / 3);
      scene.faces.push_back({vertex, vertex + 1, vertex + 2});
      for (const auto& [a, b] : {std::pair{0.0, 0.0}, {1.0, 0.1}, {0.2, 1.0}}) {
        const Vec3<double> x = place + height * up + size * (a * along + b * across);
        scene.start.insert(scene.start.end(), {x.x, x.y, x.z});
      }
    }
  }
  scene.end = scene.start;
  const std::vector<float> self_separation(scene.start.size() / 3, static_cast<float>(separation));
  Topology topology = scene.topology();
  if (within_body) topology.self_separation = self_separation;
  const Mesh mesh(topology);
  std::vector<Contact> expected;
  for (const Arithmetic arithmetic : {Arithmetic::double_only, Arithmetic::single_first}) {
    for (const char* name : {"plain", "baseline", "avx2", "avx512"}) {
      const LeafKernels* const kernels = named_kernels(name);
      if (!kernels) continue;
      INFO(name << (arithmetic == Arithmetic::double_only ? ", double" : ", single first"));
      DetectorOptions options;
      options.threads = 1;
      options.separation = within_body ? 3 * separation : separation;
      options.algorithm.arithmetic = arithmetic;
      CpuDetector detector(options, *kernels);
      detector.set_mesh(mesh);
      Stats stats;
      const Span<const Contact> found =
          detector.detect(scene.at(scene.start), scene.at(scene.end), stats);
      if (expected.empty()) expected.assign(found.begin(), found.end());
      CHECK(same_contacts(found, expected));
    }
  }
  CHECK(expected.size() > 2000);
}

TEST_CASE("every instruction set describes near pairs as one-by-one tests do") {
  MovingTriangles scene = crowd_of_triangles(600);
  // Some triangles are needles, lie on a grid with parallel edges, or do not move.
  for (std::size_t i = 0; i < scene.start.size(); ++i) {
    const std::size_t face = i / 9;
    if (face % 5 == 1 && i % 9 >= 6) {
      scene.start[i] = scene.start[i - 3];
      scene.end[i] = scene.end[i - 3];
    }
    if (face % 5 == 2) {
      scene.start[i] = std::round(16 * scene.start[i]) / 16;
      scene.end[i] = scene.start[i];
    }
  }
  for (const double unit : {0x1p-332, 1.0, 0x1p200}) {
    MovingTriangles scaled = scene;
    for (double& x : scaled.start) x *= unit;
    for (double& x : scaled.end) x *= unit;
    const Mesh mesh(scaled.topology());
    DetectorOptions options;
    options.threads = 1;
    options.separation = 0.05 * unit;
    for (const char* name : {"plain", "baseline", "avx2", "avx512"}) {
      const LeafKernels* kernels = named_kernels(name);
      if (!kernels) continue;
      CpuDetector detector(options, *kernels);
      detector.set_mesh(mesh);
      Stats stats;
      const Span<const Contact> contacts =
          detector.detect(scaled.at(scaled.start), scaled.at(scaled.end), stats);
      int differ = 0;
      for (const Contact& contact : contacts) {
        QueryCoordinates q;
        for (int k = 0; k < 4; ++k) {
          const double* x0 = &scaled.start[3 * static_cast<std::size_t>(contact.vertices[k])];
          const double* x1 = &scaled.end[3 * static_cast<std::size_t>(contact.vertices[k])];
          q.start[k] = {x0[0], x0[1], x0[2]};
          q.end[k] = {x1[0], x1[1], x1[2]};
        }
        Contact expected = contact;
        if (contact.kind == ContactKind::vertex_face) {
          describe_contact<ContactKind::vertex_face>(q, contact.toi, true, expected);
        } else {
          describe_contact<ContactKind::edge_edge>(q, contact.toi, true, expected);
        }
        differ +=
            contact.u != expected.u || contact.v != expected.v || contact.normal != expected.normal;
      }
      INFO(name << ", unit " << unit);
      CHECK(contacts.size() > 1000);
      CHECK(differ == 0);
    }
  }
}

TEST_CASE("a scene of the size of 1e-100 costs no more tests than one of size 1") {
  MovingTriangles scene = crowd_of_triangles(300);
  const Mesh mesh(scene.topology());
  for (const double separation : {0.0, 0.02}) {
    const auto stats_of = [&](double unit) {
      DetectorOptions options;
      options.threads = 1;
      options.separation = separation * unit;
      MovingTriangles scaled = scene;
      for (double& x : scaled.start) x *= unit;
      for (double& x : scaled.end) x *= unit;
      CpuDetector detector(options);
      detector.set_mesh(mesh);
      Stats stats;
      detector.detect(scaled.at(scaled.start), scaled.at(scaled.end), stats);
      return stats;
    };
    const Stats usual = stats_of(1);
    for (const double unit : {0x1p-332, 0x1p-140, 0x1p200}) {
      const Stats stats = stats_of(unit);
      INFO("unit " << unit << ", separation " << separation);
      CHECK(stats.group_pairs == usual.group_pairs);
      CHECK(stats.candidates_vf + stats.candidates_ee == usual.candidates_vf + usual.candidates_ee);
      CHECK(stats.exact_tests == usual.exact_tests);
      CHECK(stats.hash == usual.hash);
    }
  }
}
