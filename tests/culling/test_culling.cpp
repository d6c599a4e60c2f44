// Culling removes no contact: every combination gives the same contacts as no culling.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <set>
#include <vector>

#include "io/mesh.h"
#include "lazyccd/detector.h"
#include "research/culling/normal_cone.h"
#include "research/culling/orphan_sets.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/frames.h"
#include "support/generators.h"
#include "support/moving_triangles.h"

using namespace lazyccd;
using namespace lazyccd::research;
using namespace lazyccd::test;

namespace {

// A sheet of n x n cells with random waves, from almost flat to folded over itself.
MovingTriangles waving_sheet(int n, std::uint64_t seed, double height) {
  Random random(seed);
  double wave[2][4];
  for (auto& end : wave)
    for (double& w : end) w = random.uniform(-1, 1);
  MovingTriangles sheet;
  for (int end = 0; end < 2; ++end) {
    std::vector<double>& x = end == 0 ? sheet.start : sheet.end;
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n; ++j) {
        const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / n;
        const double* w = wave[end];
        const double bend =
            height * std::sin(9 * u + 6 * w[0]) + 0.02 * height * random.uniform(-1, 1);
        x.push_back(u + 1.5 * height * w[1] * std::sin(12 * u));
        x.push_back(v + 0.1 * height * w[2] * u);
        x.push_back(bend * std::cos(5 * v + w[3]));
      }
    }
  }
  for (std::int32_t i = 0; i < n; ++i) {
    for (std::int32_t j = 0; j < n; ++j) {
      const std::int32_t a = i * (n + 1) + j, b = a + n + 1;
      sheet.faces.push_back({a, b, a + 1});
      sheet.faces.push_back({a + 1, b, b + 1});
    }
  }
  return sheet;
}

std::vector<Culling> combinations() {
  std::vector<Culling> all;
  for (int bits = 0; bits < 8; ++bits)
    all.push_back({(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0});
  return all;
}

Stats detect(const Topology& topology, const Positions& start, const Positions& end,
             Culling culling, Strategy strategy = Strategy::lazy_stealing,
             FrontUse front = FrontUse::off) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.threads = 2;
  options.algorithm.culling = culling;
  options.algorithm.strategy = strategy;
  options.algorithm.front = front;
  Detector detector(options);
  detector.set_topology(topology);
  detector.detect(start, end);
  if (front == FrontUse::on) detector.detect(start, end);
  return detector.stats();
}

// Number of contacts of a sheet. Checks that it is the same with and without culling.
std::int64_t contacts_that_culling_keeps(const MovingTriangles& sheet) {
  const auto run = [&](Culling culling) {
    return detect(sheet.topology(), MovingTriangles::at(sheet.start),
                  MovingTriangles::at(sheet.end), culling);
  };
  const Stats none = run({});
  for (const Culling& culling : combinations()) CHECK(run(culling).hash == none.hash);
  return none.contacts_vf + none.contacts_ee;
}

bool contains(const OrphanSets& orphans, ContactKind kind, Candidate pair) {
  return orphans.of(kind).contains(kind, pair);
}

}  // namespace

TEST_CASE("every combination of culling gives the same contacts on waving sheets") {
  int culled = 0, with_contacts = 0;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const double height = 0.002 * std::pow(1.5, static_cast<double>(seed % 14));
    const MovingTriangles sheet = waving_sheet(24, seed, height);
    const Stats none = detect(sheet.topology(), MovingTriangles::at(sheet.start),
                              MovingTriangles::at(sheet.end), {});
    with_contacts += none.contacts_ee > 0;
    for (const Culling& culling : combinations()) {
      const Stats s = detect(sheet.topology(), MovingTriangles::at(sheet.start),
                             MovingTriangles::at(sheet.end), culling);
      CAPTURE(seed, culling.non_penetration, culling.normal_cones, culling.orphan_sets);
      CHECK(s.hash == none.hash);
      culled += s.culled_by_normal_cone > 0;
      CHECK((s.filtered_noncoplanar > 0) == culling.non_penetration);
      if (!culling.orphan_sets) CHECK(s.orphan_tests == 0);
    }
  }
  CHECK(culled > 8);
  CHECK(with_contacts > 4);
}

TEST_CASE("faces that turn over inside a flat boundary are found") {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    MovingTriangles sheet = waving_sheet(5, seed, 0);
    Random random(seed);
    for (std::size_t i = 1; i < 5; ++i)
      for (std::size_t j = 1; j < 5; ++j)
        for (std::size_t k = 0; k < 3; ++k)
          for (auto* x : {&sheet.start, &sheet.end})
            (*x)[3 * (6 * i + j) + k] = (k < 2 ? 0.5 : 0) + random.uniform(-0.3, 0.3);
    CHECK(contacts_that_culling_keeps(sheet) > 0);
  }
}

TEST_CASE("a ramp that winds over itself is found, though all its faces look up") {
  for (const double turns : {0.8, 1.02, 1.2, 1.9}) {
    // The upper end falls through the lower one. It is rotated slightly, so that no corners
    // coincide.
    MovingTriangles ramp;
    constexpr std::int32_t steps = 40;
    for (std::int32_t i = 0; i <= steps; ++i) {
      const double t = static_cast<double>(i) / steps, angle = 6.2832 * turns * t;
      for (const double radius : {1.0, 1.3}) {
        const double x = radius * std::cos(angle), y = radius * std::sin(angle);
        ramp.start.insert(ramp.start.end(), {x, y, 0.3 * t});
        ramp.end.insert(ramp.end.end(), {x, y, -0.3 * t});
      }
      if (i == steps) break;
      ramp.faces.push_back({2 * i, 2 * i + 1, 2 * i + 2});
      ramp.faces.push_back({2 * i + 2, 2 * i + 1, 2 * i + 3});
    }
    CHECK((contacts_that_culling_keeps(ramp) > 0) == (turns > 1));
  }
}

TEST_CASE("culling gives the same contacts with every strategy and from a front") {
  const MovingTriangles sheet = waving_sheet(40, 11, 0.1);
  std::set<std::uint64_t> hashes;
  for (const Strategy strategy : kStrategies)
    for (const FrontUse front : {FrontUse::off, FrontUse::on})
      hashes.insert(detect(sheet.topology(), MovingTriangles::at(sheet.start),
                           MovingTriangles::at(sheet.end), {true, true, true}, strategy, front)
                        .hash);
  CHECK(hashes.size() == 1);
}

TEST_CASE("every combination of culling gives the same contacts on real frames") {
  const auto data = data_dir();
  if (!data) return;
  for (const char* scene : {"cloth-funnel"}) {
    const io::Mesh start = read_frame_pair(*data, scene).start,
                   end = read_frame_pair(*data, scene).end;
    std::set<std::uint64_t> hashes;
    for (const Culling& culling : {Culling{}, Culling{true, true, true}}) {
      const Stats s =
          detect(io::topology(start), io::positions(start), io::positions(end), culling);
      hashes.insert(s.hash);
      std::printf(
          "%s: %lld group pairs, %lld flat nodes, %lld + %lld candidates, %lld orphans, %lld never "
          "coplanar, refit %.1f, traverse %.1f, narrow %.1f ms\n",
          scene, static_cast<long long>(s.group_pairs),
          static_cast<long long>(s.culled_by_normal_cone), static_cast<long long>(s.candidates_vf),
          static_cast<long long>(s.candidates_ee), static_cast<long long>(s.orphan_tests),
          static_cast<long long>(s.filtered_noncoplanar), s.ms_refit, s.ms_traverse, s.ms_narrow);
    }
    CHECK(hashes.size() == 1);
  }
}

TEST_CASE("the coordinates of a view span the plane perpendicular to it") {
  for (int i = 0; i < kViews; ++i) {
    const View seen = view(i);
    const auto &v = seen.along, &u = seen.u, &w = seen.w;
    const int n[3] = {u[1] * w[2] - u[2] * w[1], u[2] * w[0] - u[0] * w[2],
                      u[0] * w[1] - u[1] * w[0]};
    const bool same = n[0] == v[0] && n[1] == v[1] && n[2] == v[2];
    const bool opposite = n[0] == -v[0] && n[1] == -v[1] && n[2] == -v[2];
    CHECK((same || opposite));
  }
}

TEST_CASE("a flat sheet is culled as one patch and a closed band is not") {
  MovingTriangles flat = waving_sheet(8, 1, 0);
  CHECK(detect(flat.topology(), MovingTriangles::at(flat.start), MovingTriangles::at(flat.end),
               {true, true, false})
            .culled_by_normal_cone == 1);
  // A band around a cylinder: its ends are joined, so the boundary is two loops.
  MovingTriangles band;
  for (std::int32_t i = 0; i < 12; ++i) {
    for (const double z : {0.0, 0.2}) {
      band.start.insert(band.start.end(), {std::cos(i * 0.5236), std::sin(i * 0.5236), z});
    }
    const std::int32_t a = 2 * i, b = (2 * i + 2) % 24;
    band.faces.push_back({a, b, a + 1});
    band.faces.push_back({a + 1, b, b + 1});
  }
  CHECK(detect(band.topology(), MovingTriangles::at(band.start), MovingTriangles::at(band.start),
               {true, true, false})
            .culled_by_normal_cone < 4);
}

TEST_CASE("a body without self-collision has no patches") {
  const MovingTriangles flat = waving_sheet(8, 1, 0);
  std::vector<Body> bodies(1);
  for (const bool meets_itself : {true, false}) {
    bodies[0].self_collision = meets_itself;
    Topology topology = flat.topology();
    topology.bodies = bodies;
    const Stats s = detect(topology, MovingTriangles::at(flat.start), MovingTriangles::at(flat.end),
                           {true, true, false});
    CHECK((s.culled_by_normal_cone > 0) == meets_itself);
  }
}

TEST_CASE("the orphans of two adjacent triangles are their pairs without a shared vertex") {
  // 0-1-2 and 1-3-2 share the edge 1-2: vertex 0 with face b, vertex 3 with face a, and the edges
  // 0-1 with 2-3 and 0-2 with 1-3.
  Topology topology;
  topology.vertex_count = 4;
  const std::vector<Face> faces = {{0, 1, 2}, {1, 3, 2}};
  topology.faces = faces;
  const Mesh mesh(topology);
  const OrphanSets orphans(mesh);
  CHECK(orphans.of(ContactKind::vertex_face).count == 2);
  CHECK(orphans.of(ContactKind::edge_edge).count == 2);
  CHECK(contains(orphans, ContactKind::vertex_face, {0, 1}));
  CHECK(contains(orphans, ContactKind::vertex_face, {3, 0}));
  CHECK(orphans.adjacent_faces() == 1);
}

TEST_CASE("a pair that two faces without a shared vertex contain is no orphan") {
  // A strip of triangles: 0-1-2, 1-3-2, 2-3-4, 3-5-4. The pair of vertex 0 and face 2-3-4 belongs
  // to adjacent faces only. Vertex 3 also belongs to the last face, which shares no vertex with the
  // first.
  Topology topology;
  topology.vertex_count = 6;
  const std::vector<Face> faces = {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}, {3, 5, 4}};
  topology.faces = faces;
  const OrphanSets orphans{Mesh(topology)};
  CHECK(contains(orphans, ContactKind::vertex_face, {0, 2}));
  CHECK_FALSE(contains(orphans, ContactKind::vertex_face, {3, 0}));
}
