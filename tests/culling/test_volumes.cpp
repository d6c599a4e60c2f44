// Bounding volumes enclose everything below them and separate only pairs that are not in contact,
// so all volumes give the same contacts.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "io/mesh.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "research/volumes/node_volume.h"
#include "support/catch.h"
#include "support/data.h"
#include "support/frames.h"
#include "support/generators.h"
#include "support/moving_triangles.h"

using namespace lazyccd;
using namespace lazyccd::research;
using namespace lazyccd::test;

namespace {

// Long triangles in random directions, for which the other volumes differ from boxes.
MovingTriangles needles(std::uint64_t seed, int count, double offset, double size) {
  Random random(seed);
  MovingTriangles cloud;
  for (std::int32_t f = 0; f < count; ++f) {
    double centre[3], direction[3], motion[3];
    for (int k = 0; k < 3; ++k) {
      centre[k] = random.uniform(-1, 1);
      direction[k] = random.uniform(-0.3, 0.3);
      motion[k] = random.uniform(-0.05, 0.05);
    }
    for (int v = 0; v < 3; ++v) {
      for (int k = 0; k < 3; ++k) {
        const double x = centre[k] + (v - 1) * direction[k] + random.uniform(-0.01, 0.01);
        cloud.start.push_back(offset + size * x);
        cloud.end.push_back(offset + size * (x + motion[k]));
      }
    }
    cloud.faces.push_back({3 * f, 3 * f + 1, 3 * f + 2});
  }
  return cloud;
}

Stats detect(const Topology& topology, const Positions& start, const Positions& end, Volume volume,
             Strategy strategy = Strategy::lazy_stealing) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.threads = 2;
  options.algorithm.volume = volume;
  options.algorithm.strategy = strategy;
  Detector detector(options);
  detector.set_topology(topology);
  detector.detect(start, end);
  return detector.stats();
}

}  // namespace

TEST_CASE("a volume is found by its name, and an unknown name is refused with the known ones") {
  for (const Volume volume : kVolumes) CHECK(parse_volume(name(volume)) == volume);
  try {
    parse_volume("sphere");
    FAIL("nothing was thrown");
  } catch (const Error& error) {
    CHECK(std::string(error.what()).find("box, dop18, oriented_box") != std::string::npos);
  }
}

TEST_CASE("every volume gives the same contacts on needles, near and far, large and small") {
  struct Place {
    double offset, size;
  };
  for (const Place place :
       {Place{0, 1}, Place{1e6, 1}, Place{0, 1e-30}, Place{0, 1e30}, Place{0, 1e300}}) {
    const MovingTriangles cloud = needles(3, place.size == 1 ? 700 : 60, place.offset, place.size);
    std::set<std::uint64_t> hashes;
    for (const Volume volume : kVolumes) {
      for (const Strategy strategy : {Strategy::lazy_stealing, Strategy::thread_per_query}) {
        const Stats s = detect(cloud.topology(), MovingTriangles::at(cloud.start),
                               MovingTriangles::at(cloud.end), volume, strategy);
        hashes.insert(s.hash);
        CAPTURE(place.offset, place.size, name(volume), name(strategy));
        if (place.size == 1 || volume == Volume::box)
          CHECK((s.culled_by_volume > 0) == (volume != Volume::box));
      }
    }
    CHECK(hashes.size() == 1);
  }
}

TEST_CASE("the volume of a node overlaps those of all nodes that contain its vertices") {
  // A leaf encloses its vertices, and a parent its children. A volume that is apart from one of its
  // descendants would have lost something.
  const MovingTriangles cloud = needles(5, 600, 2, 1);
  const Mesh mesh(cloud.topology());
  std::vector<VertexRecord> records(mesh.vertex_count());
  for (std::size_t v = 0; v < records.size(); ++v)
    for (std::size_t k = 0; k < 3; ++k) {
      records[v].x[k] = cloud.start[3 * v + k];
      records[v].x[3 + k] = cloud.end[3 * v + k];
    }
  ThreadPool pool(2);
  Groups groups;
  groups.build(mesh, records, pool);
  Tree tree;
  tree.build(groups.codes(), groups.boxes(), pool);
  for (const Volume volume : {Volume::dop18, Volume::oriented_box}) {
    const auto volumes = make_node_volume(volume, 0);
    volumes->refit(groups, tree, records, pool);
    std::size_t parted = 0;
    for (std::uint32_t a = 0; a < tree.nodes().size(); ++a) {
      for (std::uint32_t b = 0; b < tree.nodes().size(); ++b) {
        const Tree::Range r = tree.ranges()[a], s = tree.ranges()[b];
        const bool related = r.first < s.last && s.first < r.last;
        const bool apart = volumes->apart(a, b);
        if (related && apart) CHECK_FALSE(apart);
        if (apart != volumes->apart(b, a)) CHECK(false);
        parted += apart;
      }
    }
    CHECK(parted > 0);
  }
}

TEST_CASE("volumes that would be apart overlap with a margin") {
  // Two triangles at a distance of 1 along a diagonal.
  MovingTriangles cloud;
  const double d = std::sqrt(0.5);
  for (const double x : {0.0, d})
    for (const double along : {0.0, 1.0, 0.5}) {
      const double p[3] = {x + along, x - along, along == 0.5 ? 1.0 : 0.0};
      cloud.start.insert(cloud.start.end(), p, p + 3);
    }
  cloud.faces = {{0, 1, 2}, {3, 4, 5}};
  Topology topology = cloud.topology();
  const std::vector<std::int32_t> bodies = {0, 0, 0, 1, 1, 1};
  topology.body_of_vertex = bodies;
  const Mesh mesh(topology);
  std::vector<VertexRecord> records(6);
  for (std::size_t v = 0; v < 6; ++v)
    for (std::size_t k = 0; k < 6; ++k) records[v].x[k] = cloud.start[3 * v + k % 3];
  ThreadPool pool(1);
  Groups groups;
  groups.build(mesh, records, pool);
  Tree tree;
  tree.build(groups.codes(), groups.boxes(), pool);
  for (const Volume volume : {Volume::dop18, Volume::oriented_box}) {
    for (const double margin : {0.4, 0.51}) {
      const auto volumes = make_node_volume(volume, margin);
      volumes->refit(groups, tree, records, pool);
      CAPTURE(name(volume), margin);
      if (margin > 0.5) CHECK_FALSE(volumes->apart(1, 2));
      if (margin == 0.4 && volume == Volume::oriented_box) CHECK(volumes->apart(1, 2));
    }
  }
}

TEST_CASE("every volume gives the same contacts with a minimum separation") {
  const MovingTriangles cloud = needles(4, 400, 0, 1);
  std::set<std::uint64_t> hashes;
  for (const Volume volume : kVolumes) {
    DetectorOptions options;
    options.backend = Backend::cpu;
    options.threads = 2;
    options.algorithm.volume = volume;
    options.separation = 0.02;
    Detector detector(options);
    detector.set_topology(cloud.topology());
    CHECK(
        !detector.detect(MovingTriangles::at(cloud.start), MovingTriangles::at(cloud.end)).empty());
    hashes.insert(detector.stats().hash);
  }
  CHECK(hashes.size() == 1);
}

TEST_CASE("every volume gives the same contacts on real frames") {
  const auto data = data_dir();
  if (!data) return;
  for (const char* scene : {"cloth-funnel"}) {
    const FramePair frames = read_frame_pair(*data, scene);
    std::set<std::uint64_t> hashes;
    for (const Volume volume : kVolumes) {
      const Stats s = detect(io::topology(frames.start), io::positions(frames.start),
                             io::positions(frames.end), volume);
      hashes.insert(s.hash);
      std::printf(
          "%s, %s: %lld tests, %lld culled, %lld group pairs, refit %.1f, traverse %.1f ms\n",
          scene, name(volume), static_cast<long long>(s.tree_tests),
          static_cast<long long>(s.culled_by_volume), static_cast<long long>(s.group_pairs),
          s.ms_refit, s.ms_traverse);
    }
    CHECK(hashes.size() == 1);
  }
}
