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
    motion.first_vertex = {0};
    for (const double metres : deviations) {
      motion.predicted.insert(motion.predicted.end(), 2, Eigen::Vector3d(1, 2, 3));
      motion.end.insert(motion.end.end(), {1, 2, 3, 1, 2, btScalar(3 - metres)});
      motion.first_vertex.push_back(motion.first_vertex.back() + 2);
    }
    for (Body& body : bodies) body.self_collision = false;
  }
  bool at_most(double between_bodies, double within_body) const {
    const std::vector<double> within(bodies.size(), within_body);
    return motion.deviates_at_most(bodies, between_bodies, within);
  }
};

}  // namespace

TEST_CASE("deviations add up over two bodies and within one body with self-collision") {
  Moved moved({0.25, 2, 0, 1, 0.5});
  CHECK(moved.at_most(3, 0));
  CHECK_FALSE(moved.at_most(2.99, 0));
  moved.bodies[3].self_collision = true;
  CHECK(moved.at_most(3, 2));
  CHECK_FALSE(moved.at_most(3, 1.99));
  moved.bodies[1].self_collision = true;
  CHECK(moved.at_most(3, 4));
  CHECK_FALSE(moved.at_most(3, 3.99));
  CHECK(Moved({}).at_most(0, 0));
  for (const std::vector<double>& two : {std::vector<double>{1, 2}, {2, 1}}) {
    CHECK(Moved(two).at_most(3, 0));
    CHECK_FALSE(Moved(two).at_most(2.99, 9));
  }
  Moved alone({1.5});
  CHECK(alone.at_most(0, 0));
  alone.bodies[0].self_collision = true;
  CHECK(alone.at_most(0, 3));
  CHECK_FALSE(alone.at_most(9, 2.99));
}
