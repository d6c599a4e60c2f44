// Distances from the core of a ball or capsule, against sampled ones.
#include "obstacles/moving_core.h"

#include <algorithm>
#include <random>

#include "support/catch.h"

using namespace lazyccd;
using bullet::Vector3d;

namespace {

// A core and a primitive that move at random, within a box of 2 m.
struct RandomMotion {
  explicit RandomMotion(unsigned number) : random(number) {
    part.core = {bullet::to_bullet(vector(1)), bullet::to_bullet(vector(1))};
    if (number % 4 == 0) part.core[1] = part.core[0];  // a ball
    rigid.start = pose(vector(1));
    rigid.end = pose(bullet::to_double(rigid.start.getOrigin()) + vector(0.5));
    start.count = end.count = 1 + static_cast<int>(number % 3);
    for (int i = 0; i < start.count; ++i) {
      start.x[i] = vector(1);
      end.x[i] = start.x[i] + vector(0.5);
    }
  }
  double within(double lo, double hi) {
    return std::uniform_real_distribution<double>(lo, hi)(random);
  }
  Vector3d vector(double size) {
    return {within(-size, size), within(-size, size), within(-size, size)};
  }
  btTransform pose(const Vector3d& origin) {
    const btQuaternion turn(bullet::to_bullet(vector(1)).normalized(),
                            static_cast<btScalar>(within(-0.5, 0.5)));
    return btTransform(turn, bullet::to_bullet(origin));
  }
  // A point of the primitive, and its distance from the core.
  double distance_of_point(const bullet::MovingCore& core, double t) {
    std::array<double, 3> weights = {within(0, 1), 0, 0};
    for (int i = 1; i < start.count; ++i) weights[i] = within(0, 1);
    const double sum = weights[0] + weights[1] + weights[2];
    const bullet::PrimitivePoints points = bullet::between(start, end, t);
    Vector3d x = Vector3d::Zero();
    for (int i = 0; i < start.count; ++i) x += weights[i] / sum * points.x[i];
    return core.distance(x, t);
  }

  std::mt19937 random;
  bullet::RoundPart part;
  bullet::RigidMotion rigid;
  bullet::PrimitivePoints start, end;
};

}  // namespace

TEST_CASE("no point of a vertex, edge or face is nearer to a core than its closest point") {
  int piercing = 0;
  for (unsigned number = 1; number <= 600; ++number) {
    CAPTURE(number);
    RandomMotion motion(number);
    const bullet::MovingCore core(motion.part, motion.rigid, false);
    const double t = motion.within(0, 1);
    const bullet::PrimitivePoints points = bullet::between(motion.start, motion.end, t);
    const bullet::ClosestPoints closest = core.closest(points, t);
    for (int i = 0; i < 200; ++i)
      CHECK(motion.distance_of_point(core, t) >= closest.distance - 1e-6);
    // The closest point has that distance.
    Vector3d x = Vector3d::Zero();
    for (int i = 0; i < points.count; ++i) {
      CHECK(closest.weights[i] >= 0);
      x += closest.weights[i] * points.x[i];
    }
    CHECK(core.distance(x, t) == Approx(closest.distance).margin(1e-6));
    CHECK(closest.between.norm() == Approx(closest.distance).margin(1e-6));
    piercing += closest.distance == 0;
  }
  CHECK(piercing > 5);
}

TEST_CASE("what is said to stay farther from a core than a radius does so at all times") {
  int farther = 0, nearer = 0;
  for (unsigned number = 1; number <= 600; ++number) {
    CAPTURE(number);
    RandomMotion motion(number);
    const bullet::MovingCore core(motion.part, motion.rigid, false);
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= 64; ++i) {
      const double t = i / 64.0;
      const auto points = bullet::between(motion.start, motion.end, t);
      nearest = std::min(nearest, core.closest(points, t).distance);
    }
    const double radius = motion.within(0.02, 0.3);
    const bool is_farther = core.is_farther(radius, motion.start, motion.end);
    CHECK(!(is_farther && nearest <= radius));
    farther += is_farther;
    nearer += nearest <= radius;
    // Far away it is found to be so.
    if (nearest > radius + 0.3) CHECK(is_farther);
  }
  CHECK(farther > 100);
  CHECK(nearer > 50);
}
