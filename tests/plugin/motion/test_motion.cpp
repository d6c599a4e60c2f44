// Tests of the motion of a step, as the response uses it.
#include "motion/motion.h"

#include <vector>

#include "support/catch.h"

using namespace lazyccd;

namespace {

// Bodies of two vertices. The second vertex of body i ends `deviations[i]` metres from Bullet's
// position.
struct Moved {
  bullet::Motion motion;
  std::vector<Body> bodies;

  explicit Moved(const std::vector<double>& deviations) : bodies(deviations.size()) {
    motion.input().first_vertex = {0};
    for (const double metres : deviations) {
      motion.predicted.insert(motion.predicted.end(), 2, bullet::Vector3d(1, 2, 3));
      motion.end.insert(motion.end.end(), {1, 2, 3, 1, 2, btScalar(3 - metres)});
      motion.input().first_vertex.push_back(motion.first_vertex().back() + 2);
    }
    for (Body& body : bodies) body.self_collision = false;
  }
  bool less_than(double between_bodies, double within_body) const {
    const std::vector<double> within(bodies.size(), within_body);
    return motion.deviates_less_than(bodies, between_bodies, within);
  }
};

}  // namespace

TEST_CASE("deviations add up over two bodies and within one body with self-collision") {
  Moved moved({0.25, 2, 0, 1, 0.5});
  CHECK(moved.less_than(3.01, 0));
  CHECK_FALSE(moved.less_than(3, 0));
  moved.bodies[3].self_collision = true;
  CHECK(moved.less_than(3.01, 2.01));
  CHECK_FALSE(moved.less_than(3.01, 2));
  moved.bodies[1].self_collision = true;
  CHECK(moved.less_than(3.01, 4.01));
  CHECK_FALSE(moved.less_than(3.01, 4));
  CHECK(Moved({}).less_than(0, 0));
  for (const std::vector<double>& two : {std::vector<double>{1, 2}, {2, 1}}) {
    CHECK(Moved(two).less_than(3.01, 0));
    CHECK_FALSE(Moved(two).less_than(3, 9));
  }
  Moved alone({1.5});
  CHECK(alone.less_than(0, 0));
  alone.bodies[0].self_collision = true;
  CHECK(alone.less_than(0, 3.01));
  CHECK_FALSE(alone.less_than(9, 3));
}

TEST_CASE("anchored vertices are found, and are forgotten one by one and together") {
  bullet::AnchoredVertices anchored;
  for (int round = 0; round < 2; ++round) {
    CHECK(anchored.empty());
    for (const std::int32_t v : {7, 2, 5}) anchored.add(v, {btVector3(0, 0, 0), 10 + v});
    anchored.remove(7);
    anchored.add(9, {btVector3(0, 0, 0), 19});
    anchored.remove(9);
    for (const std::int32_t v : {2, 5}) {
      REQUIRE(anchored.find(v));
      CHECK(anchored.find(v)->rigid == 10 + v);
    }
    for (const std::int32_t v : {0, 3, 7, 9, 100}) CHECK(!anchored.find(v));
    int sum = 0;
    for (const auto& [vertex, fixed] : anchored) sum += vertex + fixed.rigid;
    CHECK(sum == 2 + 12 + 5 + 15);
    anchored.clear();
    CHECK(!anchored.find(2));
  }
}
