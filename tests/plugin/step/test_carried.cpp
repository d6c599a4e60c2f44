// Cloth that is carried by what lies under it.
#include <BulletCollision/CollisionShapes/btBoxShape.h>

#include <cmath>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

// A cloth on a plate whose upper side is at y = 0.
struct Carried {
  ObstacleWorld w;
  btSoftBody* cloth;
  btRigidBody* plate;

  explicit Carried(World world, const bullet::SolverOptions& options = {})
      : w(world, 10, options),
        cloth(w.add_sheet(6, 0.5, 0.012, 0)),
        plate(w.add(std::make_unique<btBoxShape>(btVector3(5, btScalar(0.1), 5)),
                    btVector3(0, btScalar(-0.1), 0))) {
    cloth->m_cfg.kDF = 1;
    plate->setFriction(1);
  }
  // Runs frames of 1/60 s.
  void frames(int count, int substeps, const std::function<void(double)>& move = {}) {
    const btScalar frame = btScalar(1) / 60;
    for (int i = 0; i < count; ++i) {
      if (move) move((i + 1) / 60.0);
      w.world().stepSimulation(frame, substeps, frame / static_cast<btScalar>(substeps));
    }
  }
  btVector3 middle() const {
    btVector3 sum(0, 0, 0);
    for (int i = 0; i < cloth->m_nodes.size(); ++i) sum += cloth->m_nodes[i].m_x;
    return sum / static_cast<btScalar>(cloth->m_nodes.size());
  }
  // Where the middle of the cloth is in the frame of the plate.
  btVector3 middle_on_plate() const {
    return plate->getWorldTransform().inverse() * middle() - btVector3(0, btScalar(0.1), 0);
  }
};

}  // namespace

TEST_CASE("a kinematic body that moves once per frame carries cloth") {
  const World world = GENERATE(World::rigid, World::deformable);
  const int substeps = GENERATE(1, 2, 4);
  CAPTURE(world == World::rigid, substeps);
  Carried carried(world);
  ObstacleWorld::make_kinematic(*carried.plate);
  carried.frames(90, substeps, [&](double time) {
    const btVector3 place(static_cast<btScalar>(0.5 * std::sin(time)),
                          static_cast<btScalar>(1.5 * time - 0.1), 0);
    const btQuaternion turn(btVector3(0, 1, 0), static_cast<btScalar>(0.5 * time));
    carried.plate->setWorldTransform(btTransform(turn, place));
  });
  const btVector3 middle = carried.middle_on_plate();
  CHECK(std::abs(middle.x()) < btScalar(0.05));
  CHECK(std::abs(middle.z()) < btScalar(0.05));
  CHECK(middle.y() > 0);
  CHECK(middle.y() < btScalar(0.03));
  CHECK(carried.w.total().unresolved == 0);
}

TEST_CASE("a static body with a velocity carries cloth as a conveyor belt does") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool is_coulomb = GENERATE(false, true);
  CAPTURE(world == World::rigid, is_coulomb);
  bullet::SolverOptions options;
  options.coulomb_friction = is_coulomb;
  Carried carried(world, options);
  const btVector3 stays = carried.plate->getWorldTransform().getOrigin();
  carried.frames(120, 2, [&](double) { carried.plate->setLinearVelocity(btVector3(1, 0, 0)); });
  const btVector3 middle = carried.middle_on_plate();
  CHECK(middle.x() > btScalar(1.7));
  CHECK(middle.x() < btScalar(2.01));
  CHECK(std::abs(middle.z()) < btScalar(0.05));
  CHECK(middle.y() > 0);
  CHECK(middle.y() < btScalar(0.03));
  CHECK(carried.plate->getWorldTransform().getOrigin() == stays);
  // It stops with the belt.
  carried.frames(60, 2, [&](double) { carried.plate->setLinearVelocity(btVector3(0, 0, 0)); });
  CHECK(carried.middle_on_plate().distance(middle) < btScalar(0.2));
}

TEST_CASE("a static body that turns in its place carries cloth around") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  Carried carried(world);
  carried.cloth->translate(btVector3(1, 0, 0));
  carried.plate->setAngularVelocity(btVector3(0, -1, 0));
  carried.frames(90, 1);
  const btVector3 middle = carried.middle_on_plate();
  CHECK(std::atan2(middle.z(), middle.x()) > btScalar(1.2));
  CHECK(middle.length() < btScalar(1.2));
}

TEST_CASE("the speed of a conveyor belt changes no gap") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  Carried carried(world);
  carried.plate->setLinearVelocity(btVector3(0, 3, 0));  // along the normal: nothing to carry
  carried.frames(60, 2);
  const btVector3 middle = carried.middle_on_plate();
  CHECK(middle.y() > 0);
  CHECK(middle.y() < btScalar(0.03));
}
