// What the response asks of a step's motion.
#include "motion/motion.h"

#include <vector>

#include "support/catch.h"

using namespace lazyccd;

namespace {

// Bodies of two vertices, of which the second ends as far as that from where Bullet had it.
struct Moved {
  bullet::Motion motion;
  std::vector<Body> bodies;

  explicit Moved(const std::vector<double>& off) : bodies(off.size()) {
    motion.first_vertex = {0};
    for (const double metres : off) {
      motion.predicted.insert(motion.predicted.end(), 2, Eigen::Vector3d(1, 2, 3));
      motion.end.insert(motion.end.end(), {1, 2, 3, 1, 2, btScalar(3 - metres)});
      motion.first_vertex.push_back(motion.first_vertex.back() + 2);
    }
    for (Body& body : bodies) body.self_collision = false;
  }
  double together() const { return motion.largest_deviation_sum({bodies.data(), bodies.size()}); }
};

}  // namespace

TEST_CASE(
    "two vertices leave Bullet's motion by no more than those of two bodies, or of one twice") {
  Moved moved({0.25, 2, 0, 1, 0.5});
  CHECK(moved.together() == 3);
  moved.bodies[3].self_collision = true;  // less than with another's
  CHECK(moved.together() == 3);
  moved.bodies[1].self_collision = true;
  CHECK(moved.together() == 4);
  CHECK(Moved({}).together() == 0);
  CHECK(Moved({1, 2}).together() == 3);
  CHECK(Moved({2, 1}).together() == 3);
  Moved alone({1.5});
  CHECK(alone.together() <= 1.5);
  alone.bodies[0].self_collision = true;
  CHECK(alone.together() == 3);
}
