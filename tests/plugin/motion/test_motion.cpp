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
  double deviation_sum() const {
    return motion.largest_deviation_sum({bodies.data(), bodies.size()});
  }
};

}  // namespace

TEST_CASE("the deviation sum covers two bodies or one body with self-collision") {
  Moved moved({0.25, 2, 0, 1, 0.5});
  CHECK(moved.deviation_sum() == 3);
  moved.bodies[3].self_collision = true;  // less than the sum with another body
  CHECK(moved.deviation_sum() == 3);
  moved.bodies[1].self_collision = true;
  CHECK(moved.deviation_sum() == 4);
  CHECK(Moved({}).deviation_sum() == 0);
  CHECK(Moved({1, 2}).deviation_sum() == 3);
  CHECK(Moved({2, 1}).deviation_sum() == 3);
  Moved alone({1.5});
  CHECK(alone.deviation_sum() <= 1.5);
  alone.bodies[0].self_collision = true;
  CHECK(alone.deviation_sum() == 3);
}
