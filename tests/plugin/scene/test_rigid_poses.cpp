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
  bullet::RigidPoses poses{1e4};  // no displacement here is a jump
  bullet::WarningLog warnings{{}};

  btRigidBody* add(double mass = 0) {
    return world.add(std::make_unique<btSphereShape>(btScalar(0.1)), btVector3(0, 0, 0), mass);
  }
  void begin() { poses.begin_step(world.world().getBroadphase()); }
  void end() { poses.end_step(world.world().getBroadphase(), btScalar(1) / 60, warnings); }
  const RigidPose* of(const btCollisionObject* body) const {
    for (const RigidPose& pose : poses.all())
      if (pose.object == body) return &pose;
    return nullptr;
  }
};

void move(btRigidBody& body, double x) {
  body.getWorldTransform().setOrigin(btVector3(static_cast<btScalar>(x), 0, 0));
}

double start_of(const RigidPose* pose) { return static_cast<double>(pose->start.getOrigin().x()); }
double end_of(const RigidPose* pose) { return static_cast<double>(pose->end.getOrigin().x()); }

}  // namespace

TEST_CASE("immovable bodies are swept from the last end and free ones from this start") {
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
  CHECK(start_of(w.of(wall)) == 0);
  CHECK(start_of(w.of(free)) == 1);
  CHECK(end_of(w.of(wall)) == 2);
  CHECK(end_of(w.of(free)) == 2);
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
    REQUIRE(w.poses.all().size() == walls.size());
    for (std::size_t i = 1; i < walls.size(); ++i)
      CHECK(w.poses.all()[i - 1].unique_id < w.poses.all()[i].unique_id);
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
