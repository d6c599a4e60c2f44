// How a rigid body moves that other rigid bodies support.
#include "motion/supports.h"

#include <cmath>

#include "motion/motion.h"
#include "support/catch.h"
#include "util/matrix.h"

using namespace lazyccd::bullet;

namespace {

constexpr double mass = 2, weight = 0.01, friction = 0.5;  // kg, kg m, 1

// A cube of edge 1.
RigidMotion cube() {
  RigidMotion body = {};
  body.inverse_mass = Vector3d::Constant(1 / mass);
  body.inverse_inertia = 6 / mass * Matrix3d::Identity();
  return body;
}

void add_support(RigidMotion& body, const Vector3d& arm, double load) {
  Support support = {};
  support.normal = Vector3d::Unit(1);
  support.arm = arm;
  support.load = load;
  support.friction_impulse.setZero();
  support.friction = friction;
  body.supports.push_back(support);
}

RigidMotion cube_on_floor() {
  RigidMotion body = cube();
  for (const double x : {-0.5, 0.5})
    for (const double z : {-0.5, 0.5}) add_support(body, {x, -0.5, z}, weight / 4);
  body.supported_mobility = mobility_at_supports(body);
  return body;
}

Vector6d impulse_at(const Vector3d& arm, const Vector3d& impulse) {
  return stacked(impulse, arm.cross(impulse));
}

}  // namespace

TEST_CASE("a cube on a floor is as heavy as the floor") {
  RigidMotion body = cube_on_floor();
  REQUIRE(body.supported_mobility);
  CHECK(body.supported_mobility->isZero());
  CHECK(!leave_supports(body, impulse_at({0.1, 0.5, 0.3}, {0, -10 * weight, 0}), body));
  CHECK(body.supports.size() == 4);
}

TEST_CASE("a pull lifts a cube if it exceeds the weight") {
  RigidMotion body = cube_on_floor();
  CHECK(!leave_supports(body, impulse_at({0, 0.5, 0}, {0, 0.9 * weight, 0}), body));
  CHECK(leave_supports(body, impulse_at({0, 0.5, 0}, {0, 1.1 * weight, 0}), body));
  CHECK(body.supports.empty());
  CHECK(!body.supported_mobility);
}

TEST_CASE("a pull at an edge of a cube turns it about the edge on the other side") {
  RigidMotion body = cube_on_floor();
  CHECK(!leave_supports(body, impulse_at({0.5, 0.5, 0}, {0, 0.4 * weight, 0}), body));
  const Vector6d pull = impulse_at({0.5, 0.5, 0}, {0, 0.7 * weight, 0});
  REQUIRE(leave_supports(body, pull, body));
  CHECK(body.supports.size() == 2);
  REQUIRE(body.supported_mobility);
  const Vector6d moved = *body.supported_mobility * pull;
  CHECK(moved[5] > 0);
  for (const Support& support : body.supports) {
    CHECK(support.arm.x() == -0.5);
    CHECK((support.jacobian() * moved).norm() < 1e-6 * moved.norm());
  }
}

TEST_CASE("a push at a height where it does not tip a cube slides it if it exceeds the friction") {
  RigidMotion body = cube_on_floor();
  const Vector3d low(0.5, -0.5, 0);
  CHECK(!leave_supports(body, impulse_at(low, {-0.9 * friction * weight, 0, 0}), body));
  const Vector6d push = impulse_at(low, {-1.5 * friction * weight, 0, 0});
  REQUIRE(leave_supports(body, push, body));
  CHECK(body.supports.size() == 4);
  REQUIRE(body.supported_mobility);
  const Vector6d moved = *body.supported_mobility * push;
  CHECK(moved[0] < 0);
  CHECK(std::abs(moved[1]) < 1e-9 * std::abs(moved[0]));
}

TEST_CASE("a body on one point rolls over it") {
  RigidMotion body = cube();
  add_support(body, {0, -0.5, 0}, weight);
  body.supported_mobility = mobility_at_supports(body);
  REQUIRE(body.supported_mobility);
  const Vector6d moved = *body.supported_mobility * impulse_at({0, 0.5, 0}, {weight, 0, 0});
  CHECK(moved[0] == Approx(-0.5 * moved[5]));
  CHECK(moved[0] > 0);
  CHECK(std::abs(moved[1]) < 1e-9 * moved[0]);
}
