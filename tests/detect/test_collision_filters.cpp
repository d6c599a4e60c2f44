// Collision filters: groups and masks, disabled pairs, self-collision.
#include <cstdint>
#include <utility>
#include <vector>

#include "lazyccd/detector.h"
#include "support/catch.h"
#include "support/moving_triangles.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// Two bodies of two triangles each. Every triangle passes through all others.
struct Crossing {
  MovingTriangles triangles;
  std::vector<Body> bodies = std::vector<Body>(2);
  std::vector<BodyPair> disabled;

  Crossing() {
    for (Body& body : bodies) body.self_collision = false;
    for (std::int32_t i = 0; i < 4; ++i) {
      const double from = 0.1 * i, to = -0.2 * i, aside = 0.01 * i;
      for (const auto& [x, z] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}) {
        triangles.start.insert(triangles.start.end(), {x + aside, from, z - aside});
        triangles.end.insert(triangles.end.end(), {x + aside, to, z - aside});
      }
      triangles.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    }
  }

  // Numbers of contacts between the bodies and within each body.
  struct Found {
    int between = 0, within[2] = {0, 0};
  };
  Found found() const {
    DetectorOptions options;
    options.backend = Backend::cpu;
    Detector detector(options);
    Topology topology = triangles.topology();
    const std::vector<std::int32_t> body_of_vertex = body_of_each(triangles, 2);
    topology.body_of_vertex = body_of_vertex;
    topology.bodies = bodies;
    topology.disabled_pairs = disabled;
    detector.set_topology(topology);
    Found result;
    for (const Contact& contact :
         detector.detect(triangles.at(triangles.start), triangles.at(triangles.end)))
      ++(contact.body_a == contact.body_b ? result.within[contact.body_a] : result.between);
    return result;
  }
};

}  // namespace

TEST_CASE("two bodies collide if the group of each is in the mask of the other") {
  Crossing scene;
  const std::uint32_t group_a = GENERATE(0u, 1u, 6u), mask_a = GENERATE(0u, 2u, 12u),
                      group_b = GENERATE(0u, 2u, 8u), mask_b = GENERATE(0u, 1u, 4u);
  CAPTURE(group_a, mask_a, group_b, mask_b);
  scene.bodies[0].group = group_a;
  scene.bodies[0].mask = mask_a;
  scene.bodies[1].group = group_b;
  scene.bodies[1].mask = mask_b;
  CHECK((scene.found().between > 0) == ((group_a & mask_b) != 0 && (group_b & mask_a) != 0));
}

TEST_CASE("a disabled pair does not collide whichever body is named first") {
  Crossing scene;
  CHECK(scene.found().between > 0);
  scene.disabled = {GENERATE(BodyPair{0, 1}, BodyPair{1, 0})};
  CHECK(scene.found().between == 0);
}

TEST_CASE("self-collision depends on its flag and not on groups") {
  Crossing scene;
  const int asked = GENERATE(0, 1);
  scene.bodies[asked].self_collision = true;
  scene.bodies[asked].group = scene.bodies[asked].mask = GENERATE(0u, 1u);
  const Crossing::Found found = scene.found();
  CHECK(found.within[asked] > 0);
  CHECK(found.within[1 - asked] == 0);
}
