#include "scene/rigid_poses.h"

#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using bullet::RigidPose;

namespace {

struct Watched {
  ObstacleWorld world{scenes::World::rigid, 0};
  bullet::RigidPoses poses;
  bullet::WarningLog warnings{{}};

  // By default no displacement here is a jump.
  explicit Watched(double jump_speed = 1e4) : poses(static_cast<btScalar>(jump_speed)) {}
  btRigidBody* add(double mass = 0) {
    return world.add(std::make_unique<btSphereShape>(btScalar(0.1)), btVector3(0, 0, 0), mass);
  }
  void begin() { poses.begin_step(world.world().getBroadphase()); }
  void end() {
    world.world().performDiscreteCollisionDetection();
    poses.end_step(world.world().getBroadphase(), btScalar(1) / 60, warnings);
  }
  // Null if the body is not followed.
  const RigidPose* of(const btCollisionObject* body) const {
    for (const RigidPose* const pose : poses.followed())
      if (pose->object == body) return pose;
    return nullptr;
  }
};

void move(btRigidBody& body, double x) {
  body.getWorldTransform().setOrigin(btVector3(static_cast<btScalar>(x), 0, 0));
}

double start_of(const RigidPose* pose) { return static_cast<double>(pose->start.getOrigin().x()); }
double end_of(const RigidPose* pose) { return static_cast<double>(pose->end.getOrigin().x()); }

}  // namespace

TEST_CASE("bodies are swept from the last end, whether Bullet or the application moves them") {
  Watched w;
  btRigidBody *wall = w.add(), *free = w.add(1);
  w.begin();
  w.end();
  move(*wall, 1);
  move(*free, 1);
  w.begin();
  move(*wall, 2);
  move(*free, 2);
  w.end();
  for (const btRigidBody* const body : {wall, free}) {
    CHECK(start_of(w.of(body)) == 0);
    CHECK(end_of(w.of(body)) == 2);
    CHECK_FALSE(w.of(body)->jumped);
    CHECK(w.of(body)->driven == (body == free));
  }
}

TEST_CASE("a free body starts where the response left it, and is driven if it is not there") {
  Watched w;
  btRigidBody* const free = w.add(1);
  const auto step = [&](double x) {
    w.begin();
    move(*free, x);
    w.end();
  };
  step(1);
  const btTransform pushed(btQuaternion::getIdentity(), btVector3(btScalar(0.5), 0, 0));
  w.poses.set_response_end(w.of(free)->unique_id, pushed);
  SECTION("there") {
    free->setWorldTransform(pushed);
    step(2);
    CHECK_FALSE(w.of(free)->driven);
  }
  SECTION("there but for rounding") {
    move(*free, 0.5 * (1 + 2 * static_cast<double>(SIMD_EPSILON)));
    CHECK_FALSE(free->getWorldTransform() == pushed);
    step(2);
    CHECK_FALSE(w.of(free)->driven);
  }
  SECTION("elsewhere") {
    step(2);
    CHECK(w.of(free)->driven);
  }
  CHECK(start_of(w.of(free)) == 0.5);
  CHECK(end_of(w.of(free)) == 2);
}

TEST_CASE("a free body starts where it is put if that is too far for a motion") {
  const bool is_told = GENERATE(false, true);
  Watched w(is_told ? 1e4 : 5);
  btRigidBody* const free = w.add(1);
  w.begin();
  w.end();
  move(*free, 0.2);  // 12 m/s
  if (is_told) w.poses.teleported(*free);
  w.begin();
  w.end();
  CHECK(w.of(free)->jumped);
  CHECK_FALSE(w.of(free)->driven);
  CHECK_THAT(start_of(w.of(free)), Matchers::WithinAbs(0.2, 1e-6));
  move(*free, 0.4);
  w.begin();
  w.end();
  CHECK(w.of(free)->driven);  // as in the step before
  CHECK_THAT(start_of(w.of(free)), Matchers::WithinAbs(0.2, 1e-6));
}

TEST_CASE("a free body that is put near a box of soft bodies can be made to jump") {
  Watched w;
  btRigidBody* const free = w.add(1);
  w.begin();
  w.end();
  move(*free, 1);
  w.begin();
  w.end();
  w.poses.let_driven_jump({btVector3(3, 3, 3), btVector3(4, 4, 4)});
  CHECK(w.of(free)->driven);
  w.poses.let_driven_jump({btVector3(-1, -1, -1), btVector3(4, 4, 4)});
  CHECK(w.of(free)->jumped);
  CHECK(start_of(w.of(free)) == 1);
}

TEST_CASE("rigid bodies keep their poses while others are added and removed") {
  Watched w;
  std::vector<btRigidBody*> walls;
  for (int i = 0; i < 20; ++i) walls.push_back(w.add());
  w.begin();
  w.end();
  for (int round = 0; round < 5; ++round) {
    w.begin();
    // One is removed and one added, perhaps at the same address.
    w.world.remove(walls.front());
    walls.erase(walls.begin());
    walls.push_back(w.add());
    move(*walls.back(), 7);
    move(*walls.front(), round + 1);
    w.end();
    w.poses.follow(std::vector<AxisBox>{{btVector3(-9, -9, -9), btVector3(9, 9, 9)}}, w.warnings);
    REQUIRE(w.poses.followed().size() == walls.size());
    for (std::size_t i = 1; i < walls.size(); ++i)
      CHECK(w.poses.followed()[i - 1]->unique_id < w.poses.followed()[i]->unique_id);
    CHECK(start_of(w.of(walls.back())) == 7);
    CHECK(start_of(w.of(walls.front())) == 0);
    CHECK(end_of(w.of(walls.front())) == round + 1);
  }
}

TEST_CASE("a held body catches up at twice the speed at most") {
  Watched w;
  btRigidBody* const wall = w.add();
  w.begin();
  w.end();
  move(*wall, 10);
  w.begin();
  w.end();
  w.poses.hold_at_start(*wall);
  for (const double end : {2.0, 4.0, 6.0}) {
    move(*wall, 10 + end / 2);
    w.begin();
    w.end();
    CHECK_THAT(end_of(w.of(wall)), Matchers::WithinAbs(end, 1e-5));
  }
}

namespace {

// Moves a kinematic body to x as Bullet does before the first of the substeps of a frame.
void move_in_frame(btRigidBody& body, double x, int substeps) {
  move(body, x);
  body.saveKinematicState(static_cast<btScalar>(substeps) / 60);
}

}  // namespace

TEST_CASE("a kinematic body moves evenly over the substeps of a frame") {
  const double jump_speed = GENERATE(1.0, 1e4);
  CAPTURE(jump_speed);
  Watched w(jump_speed);
  btRigidBody* const wall = w.add();
  ObstacleWorld::make_kinematic(*wall);
  const auto step = [&] {
    w.begin();
    w.end();
  };
  const auto check_end = [&](double x) {
    REQUIRE(w.of(wall) != nullptr);
    CHECK_THAT(end_of(w.of(wall)), Matchers::WithinAbs(x, 1e-5));
  };
  step();
  for (int frame = 0; frame < 3; ++frame) {
    for (int i = 0; i < 4; ++i) {
      if (i == 0) move_in_frame(*wall, 4 * (frame + 1), 4);
      step();
      check_end(4 * frame + i + 1);
      CHECK_THAT(start_of(w.of(wall)), Matchers::WithinAbs(4 * frame + i, 1e-5));
    }
    CHECK(end_of(w.of(wall)) == 4 * (frame + 1));
  }
  SECTION("frames of different numbers of substeps") {
    for (const int substeps : {1, 3, 2}) {
      const double from = end_of(w.of(wall));
      move_in_frame(*wall, from + substeps, substeps);
      for (int i = 0; i < substeps; ++i) {
        step();
        check_end(from + i + 1);
      }
    }
  }
  SECTION("a body that is moved during a frame is there at once") {
    move_in_frame(*wall, 16, 4);
    step();
    check_end(13);
    move(*wall, 14.5);
    step();
    CHECK(end_of(w.of(wall)) == 14.5);
  }
  SECTION("a lag is made up for in the next frame") {
    move_in_frame(*wall, 16, 4);
    step();
    move_in_frame(*wall, 20, 4);
    step();
    check_end(20);
  }
  SECTION("a body that stops in the middle of a frame reaches its pose") {
    move_in_frame(*wall, 16, 4);
    step();
    wall->setLinearVelocity(btVector3(0, 0, 0));
    step();
    check_end(16);
    CHECK_FALSE(w.of(wall)->jumped);
  }
  SECTION("a body that becomes dynamic starts where it was") {
    move_in_frame(*wall, 16, 4);
    step();
    wall->setCollisionFlags(0);
    step();
    CHECK_THAT(start_of(w.of(wall)), Matchers::WithinAbs(13, 1e-5));
    check_end(16);
    step();
    CHECK(start_of(w.of(wall)) == 16);
  }
  SECTION("a body that nodes are anchored to moves with them") {
    w.poses.set_carriers({wall});
    move_in_frame(*wall, 16, 4);
    step();
    check_end(16);
  }
  SECTION("a body that was put elsewhere is not swept") {
    move_in_frame(*wall, 16, 4);
    w.poses.teleported(*wall);
    step();
    CHECK(w.of(wall)->jumped);
    check_end(16);
  }
}

TEST_CASE("a kinematic body turns evenly over the substeps of a frame") {
  Watched w;
  btRigidBody* const wall = w.add();
  ObstacleWorld::make_kinematic(*wall);
  w.begin();
  w.end();
  const btVector3 axis(0, 0, 1);
  for (int i = 0; i < 8; ++i) {
    if (i % 4 == 0) {
      const btQuaternion turned(axis, btScalar(0.4) * (i + 4));
      wall->setWorldTransform(btTransform(turned));
      wall->saveKinematicState(btScalar(4) / 60);
    }
    w.begin();
    w.end();
    const btQuaternion expected(axis, btScalar(0.4) * (i + 1));
    REQUIRE(w.of(wall) != nullptr);
    CHECK(w.of(wall)->end.getRotation().angleShortestPath(expected) < btScalar(2e-3));
  }
}

TEST_CASE("an immovable body at rest is followed again when it moves or is near") {
  Watched w;
  btRigidBody *wall = w.add(), *free = w.add(1);
  const auto step = [&] {
    w.begin();
    w.end();
  };
  for (int i = 0; i < 5; ++i) step();
  CHECK(w.of(wall) == nullptr);
  CHECK(w.of(free) != nullptr);
  const bullet::AxisBox near = {btVector3(-1, -1, -1), btVector3(1, 1, 1)};
  SECTION("near") {
    w.poses.follow(std::vector<AxisBox>{near.expanded(btVector3(-10, 0, 0))}, w.warnings);
    CHECK(w.of(wall) == nullptr);
    w.poses.follow(std::vector<AxisBox>{near}, w.warnings);
    REQUIRE(w.of(wall) != nullptr);
    CHECK(w.poses.followed().size() == 2);
    CHECK(w.of(wall)->at_rest);
    step();
    CHECK(w.of(wall) == nullptr);
  }
  SECTION("moved") {
    move(*wall, 3);
    step();
    REQUIRE(w.of(wall) != nullptr);
    CHECK(start_of(w.of(wall)) == 0);
    CHECK(end_of(w.of(wall)) == 3);
  }
  SECTION("turned where it is") {
    const btTransform turned(btQuaternion(btVector3(1, 0, 0), btScalar(0.5)));
    wall->setWorldTransform(turned);
    step();
    w.poses.follow(std::vector<AxisBox>{near}, w.warnings);
    REQUIRE(w.of(wall) != nullptr);
    CHECK(w.of(wall)->end == turned);
    CHECK(w.of(wall)->start == btTransform::getIdentity());
  }
  SECTION("put elsewhere") {
    move(*wall, 3);
    w.poses.teleported(*wall);
    step();
    REQUIRE(w.of(wall) != nullptr);
    CHECK(start_of(w.of(wall)) == 3);
  }
  SECTION("removed") {
    w.world.remove(wall);
    step();
    w.poses.follow(std::vector<AxisBox>{near}, w.warnings);
    CHECK(w.poses.followed().size() == 1);
  }
  SECTION("all removed, and as many added with the same ids") {
    w.world.remove(wall);
    w.world.remove(free);
    w.world.world().getBroadphase()->resetPool(w.world.world().getDispatcher());
    btRigidBody *first = w.add(), *second = w.add();
    step();
    w.poses.follow(std::vector<AxisBox>{near}, w.warnings);
    CHECK(w.poses.followed().size() == 2);
    CHECK(w.of(first) != nullptr);
    CHECK(w.of(second) != nullptr);
  }
}
