// What of a soft body may be near something, against the bounds of each edge and face.
#include "obstacles/soft_bounds.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "plugin/support/draped_sheet.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// A motion of a sheet with 169 nodes.
std::unique_ptr<DrapedSheet> make_sheet(unsigned number) {
  auto draped = std::make_unique<DrapedSheet>(
      std::make_unique<btBoxShape>(btVector3(1, 1, 1)),
      [](double, double, double gap) { return 1 + gap; }, number);
  draped->read();
  return draped;
}

template <class Primitives>
std::vector<std::int32_t> near_of(const Primitives& primitives, const bullet::IndexRange& range,
                                  const bullet::Motion& motion, bool at_start,
                                  const bullet::MotionBounds& other, double distance) {
  std::vector<std::int32_t> near;
  for (std::int32_t i = range.first; i < range.last; ++i) {
    bullet::MotionBounds bounds;
    for (const std::int32_t v : primitives[static_cast<std::size_t>(i)])
      bounds.add(bullet::MotionBounds(motion, v, v + 1, at_start));
    if (!bullet::are_apart(bounds, other, distance)) near.push_back(i);
  }
  return near;
}

std::vector<std::int32_t> sorted(std::vector<std::int32_t> list) {
  std::sort(list.begin(), list.end());
  return list;
}

// Compares with the bounds of each face and edge. Returns the number of faces that are near.
std::size_t check(bullet::SoftBounds& bounds, const bullet::StepTopology& step_topology,
                  const bullet::Motion& motion, bool at_start, const bullet::MotionBounds& other,
                  double distance) {
  const Topology topology = step_topology.topology();
  const bullet::StepTopology::BodyRecord& soft = step_topology.bodies()[0];
  const bullet::NearPrimitives near = bounds.find_near(0, other, distance);
  CHECK(sorted(near.faces) ==
        near_of(topology.faces, soft.faces, motion, at_start, other, distance));
  CHECK(sorted(near.edges) ==
        near_of(topology.edges, soft.edges, motion, at_start, other, distance));
  std::set<std::int32_t> vertices;
  for (const std::int32_t f : near.faces)
    vertices.insert(topology.faces[f].begin(), topology.faces[f].end());
  for (const std::int32_t e : near.edges)
    vertices.insert(topology.edges[e].begin(), topology.edges[e].end());
  CHECK(near.vertices == std::vector<std::int32_t>(vertices.begin(), vertices.end()));
  return near.faces.size();
}

}  // namespace

TEST_CASE("soft bounds find the edges and faces whose own bounds are near") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t none = 0, some = 0, all = 0;
  for (unsigned number = 1; number <= 20; ++number) {
    const auto draped = make_sheet(number);
    const bullet::StepTopology& topology = draped->reader().topology();
    const bullet::Motion& motion = draped->reader().motion();
    bullet::SoftBounds bounds(topology, motion);
    bounds.set_topology();
    const auto faces = static_cast<std::size_t>(topology.bodies()[0].faces.last);
    for (int i = 0; i < 20; ++i) {
      const bool at_start = i % 2 == 1;
      bounds.begin(at_start);
      const auto v = static_cast<std::int32_t>(unit(random) * motion.soft_count());
      bullet::MotionBounds other;
      if (i % 5 == 0)  // around the sheet
        other.add(motion.start_of(v) - bullet::Vector3d::Ones());
      const double size = i % 5 == 0 ? 1 : 0.05;
      for (int corner = 0; corner < 2; ++corner)
        other.add(motion.start_of(v) +
                  size * bullet::Vector3d(unit(random), unit(random) - 0.5, unit(random)));
      const std::size_t near =
          check(bounds, topology, motion, at_start, other, 0.02 * unit(random));
      ++(near == 0 ? none : near == faces ? all : some);
    }
  }
  CHECK(none > 20);
  CHECK(some > 100);
  CHECK(all > 5);
}

TEST_CASE("soft bounds find what is not finite") {
  const auto draped = make_sheet(3);
  const bullet::StepTopology& topology = draped->reader().topology();
  bullet::Motion motion = draped->reader().motion();
  bullet::SoftBounds bounds(topology, motion);
  bounds.set_topology();
  bullet::MotionBounds far;
  far.add(motion.start_of(0) + bullet::Vector3d::Constant(1e3));
  bounds.begin(false);
  CHECK(bounds.find_near(0, far, 0.1).empty());
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    motion.end[3 * 40 + 1] = static_cast<btScalar>(value);
    bounds.begin(false);
    CHECK(check(bounds, topology, motion, false, far, 0.1) > 0);
  }
}
