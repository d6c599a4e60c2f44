// Links of multibodies and dynamic bodies that the application moves between steps.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "plugin/support/arm.h"
#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/soft_body_figures.h"
#include "plugin/support/tetrahedra.h"
#include "scenes/behaviour/multibody.h"
#include "scenes/meshes/solid.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

constexpr double tick = 1.0 / 240;

// Three links on a fixed base at the origin, and a cloth.
struct Scene {
  ObstacleWorld w;
  Arm arm;
  btSoftBody* cloth = nullptr;

  Scene(World world, double gravity, const btVector3& axis)
      : w(world, gravity, {}, true), arm(w, 3, true, btVector3(0, 0, 0), axis) {}
  // A square whose corner is at `corner` and that is spanned by `u` and `v`.
  void add_cloth(int nodes, const btVector3& corner, const btVector3& u, const btVector3& v,
                 double margin = 0.01) {
    auto body = scenes::make_cloth(w.info(), nodes, nodes, 0.3, [&](double a, double b) {
      return corner + static_cast<btScalar>(a) * u + static_cast<btScalar>(b) * v;
    });
    cloth = w.add(std::move(body), margin);
    cloth->m_cfg.collisions |= btSoftBody::fCollision::SDF_MDF;
  }
  int nodes_inside(double depth) const {
    int count = 0;
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
      count += arm.contains(cloth->m_nodes[i].m_x, depth);
    return count;
  }
  double fastest() const {
    btScalar fastest = 0;
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
      fastest = std::max(fastest, cloth->m_nodes[i].m_v.length());
    return fastest;
  }
};

// A cloth that hangs across the path of an arm that turns about the vertical.
struct Curtain : Scene {
  explicit Curtain(World world) : Scene(world, 10, btVector3(0, 1, 0)) {
    add_cloth(17, btVector3(btScalar(0.4), btScalar(0.3), 0), btVector3(btScalar(0.6), 0, 0),
              btVector3(0, btScalar(-0.6), 0));
    for (int i = 0; i < cloth->m_nodes.size(); ++i)
      if (cloth->m_nodes[i].m_x.y() > btScalar(0.299)) cloth->setMass(i, 0);
  }
  // Positive on the side to which a rising joint angle turns the arm.
  double side_of(int node) const {
    const btTransform& pose = arm.link(2).getWorldTransform();
    return -static_cast<double>(pose.invXform(cloth->m_nodes[node].m_x).z());
  }
};

// Two fingers that close around a block of rubber. A force of 5 N closes the first. The application
// sets the second to the place and velocity of the first each step: a mimic joint.
struct Gripper {
  ObstacleWorld w;
  btDeformableNeoHookeanForce rubber{5000, 5000, btScalar(0.05)};
  std::unique_ptr<scenes::behaviour::Multibody> hand;
  btSoftBody* block;

  Gripper() : w(World::deformable, 0) {
    const auto vector = [](double x, double y, double z) {
      return btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y),
                       static_cast<btScalar>(z));
    };
    std::vector<scenes::behaviour::BoxLink> fingers(2);
    for (int i = 0; i < 2; ++i) {
      const double sign = i == 0 ? -1 : 1;
      fingers[i].joint = scenes::behaviour::Joint::prismatic;
      fingers[i].axis = vector(-sign, 0, 0);
      fingers[i].pivot = vector(sign * 0.06, 0, 0);
      fingers[i].size = vector(0.016, 0.08, 0.06);
      fingers[i].mass = 0.2;
    }
    hand = std::make_unique<scenes::behaviour::Multibody>(vector(0, 0, 0), vector(0, 0, 0), 1, true,
                                                          fingers);
    hand->body().setCanSleep(false);
    hand->add_to(static_cast<btMultiBodyDynamicsWorld&>(w.world()));
    const auto at = [&](double x, double y, double z) {
      return vector(0.075 * (x - 0.5), 0.06 * (y - 0.5), 0.12 * (z - 0.5));
    };
    block = w.add(scenes::make_solid(w.info(), {5, 4, 8}, 0.1, at), 0.002);
    orient_tetrahedra(*block);
    block->m_cfg.kDF = 1;
    block->m_cfg.collisions |= btSoftBody::fCollision::SDF_MDF;
    static_cast<btDeformableMultiBodyDynamicsWorld&>(w.world()).addForce(block, &rubber);
  }
  ~Gripper() {
    static_cast<btDeformableMultiBodyDynamicsWorld&>(w.world()).removeForce(block, &rubber);
  }
  // Returns the speed of the fastest node, m/s.
  double close(int steps) {
    double fastest = 0;
    w.steps(steps, tick, [&](int) {
      fastest = std::max(fastest, speed(*block));
      btMultiBody& body = hand->body();
      body.addJointTorque(0, 5);
      body.setJointPos(1, body.getJointPos(0));
      body.setJointVel(1, body.getJointVel(0));
      btAlignedObjectArray<btQuaternion> rotations;
      btAlignedObjectArray<btVector3> origins;
      body.forwardKinematics(rotations, origins);
      body.updateCollisionObjectWorldTransforms(rotations, origins);
    });
    return static_cast<double>(fastest);
  }
};

}  // namespace

TEST_CASE("a soft block rests between a finger and one that is set to copy it") {
  Gripper scene;
  CHECK(scene.close(120) < 3);
  CHECK(scene.close(120) < 0.1);
  const double closed = static_cast<double>(scene.hand->body().getJointPos(0));
  UNSCOPED_INFO("closed " << closed);
  CHECK(closed > 0.01);
  CHECK(closed < 0.02);
  CHECK(scene.w.total().initial_intersections == 0);
  CHECK(scene.w.total().failsafe_holds == 0);
}

TEST_CASE("a cloth lies on links that are set to the same place each step") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  Scene scene(world, 10, btVector3(0, 0, 1));
  scene.arm.set_joints(0);
  scene.add_cloth(13, btVector3(btScalar(0.3), btScalar(0.11), btScalar(-0.3)),
                  btVector3(btScalar(0.6), 0, 0), btVector3(0, 0, btScalar(0.6)), 1e-4);
  scene.w.steps(240, tick, [&](int) { scene.arm.set_joints(0); });
  CHECK(scene.w.total().initial_intersections == 0);
  CHECK(scene.w.total().failsafe_holds == 0);
  CHECK(scene.nodes_inside(0) == 0);
  const btSoftBody::Node& middle = scene.cloth->m_nodes[6 * 13 + 6];
  CHECK(middle.m_x.y() > btScalar(0.099));
  CHECK(middle.m_v.length() < btScalar(0.2));
}

TEST_CASE("a link that is set onwards each step carries a hanging cloth") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool with_velocity = GENERATE(false, true);
  CAPTURE(world == World::rigid, with_velocity);
  Curtain scene(world);
  const double speed = 1, first = -0.5;  // rad/s, rad
  scene.arm.set_joints(first);
  int inside = 0;
  double fastest = 0;
  scene.w.steps(240, tick, [&](int i) {
    inside += scene.nodes_inside(0);
    fastest = std::max(fastest, scene.fastest());
    scene.arm.set_joints(first + speed * tick * (i + 1), with_velocity ? speed : 0);
  });
  CHECK(inside == 0);
  CHECK(scene.w.total().initial_intersections == 0);
  CHECK(scene.w.total().failsafe_holds == 0);
  CHECK(scene.w.total().unresolved == 0);
  CHECK(fastest < 6);
  int met = 0;
  for (int i = 0; i < scene.cloth->m_nodes.size(); ++i) {
    const btVector3& x = scene.cloth->m_nodes[i].m_x;
    const btVector3 local = scene.arm.link(2).getWorldTransform().invXform(x);
    if (std::abs(local.x()) > btScalar(0.1) || std::abs(local.y()) > btScalar(0.1)) continue;
    ++met;
    CHECK(scene.side_of(i) > 0.1);
  }
  CHECK(met > 5);
}

TEST_CASE("a link that is set into a cloth comes out of it") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool stays_set = GENERATE(false, true);
  CAPTURE(world == World::rigid, stays_set);
  Curtain scene(world);
  scene.w.steps(10, tick, [&](int) { scene.arm.set_joints(-1.5); });
  REQUIRE(scene.w.total().initial_intersections == 0);
  scene.arm.set_joints(-0.02);
  scene.w.steps(1, tick);
  CHECK(scene.w.last().initial_intersections > 0);
  double fastest = 0;
  scene.w.steps(240, tick, [&](int) {
    if (stays_set) scene.arm.set_joints(-0.02);
    fastest = std::max(fastest, scene.fastest());
  });
  CHECK(scene.nodes_inside(0.002) == 0);
  CHECK(fastest < 5);
}

TEST_CASE("a dynamic body that is moved by hand each step carries cloth") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btSoftBody* const cloth = w.add_sheet(13, 2, 0, 0);
  scenes::pin_border(*cloth, 13, 13);
  const auto at = [](int i) { return btVector3(0, static_cast<btScalar>(0.31 - i * tick), 0); };
  const btVector3 half(btScalar(0.3), btScalar(0.2), btScalar(0.3));
  btRigidBody* const box = w.add(std::make_unique<btBoxShape>(half), at(0), 10);
  int below = 0;
  w.steps(120, tick, [&](int i) {
    below += cloth->m_nodes[84].m_x.y() > box->getWorldTransform().getOrigin().y() - btScalar(0.2);
    btTransform pose = box->getWorldTransform();
    pose.setOrigin(at(i + 1));
    box->setWorldTransform(pose);
    box->setLinearVelocity(btVector3(0, 0, 0));
    box->setAngularVelocity(btVector3(0, 0, 0));
  });
  CHECK(below == 0);
  CHECK(cloth->m_nodes[84].m_x.y() < btScalar(-0.3));
  CHECK(w.total().initial_intersections == 0);
  CHECK(w.total().failsafe_holds == 0);
  CHECK(w.total().unresolved == 0);
}

TEST_CASE("a dynamic body that is moved by hand gets the impulses that it gives") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btSoftBody* const cloth = w.add_sheet(9, 1, 0, 0);
  cloth->m_cfg.kDP = 0;
  const btVector3 half(btScalar(0.3), btScalar(0.2), btScalar(0.3));
  btRigidBody* const box =
      w.add(std::make_unique<btBoxShape>(half), btVector3(0, btScalar(0.22), 0), 1);
  w.steps(24, tick, [&](int) { box->translate(btVector3(0, static_cast<btScalar>(-tick), 0)); });
  btVector3 of_cloth(0, 0, 0);
  for (int i = 0; i < cloth->m_nodes.size(); ++i)
    of_cloth += cloth->m_nodes[i].m_v / cloth->m_nodes[i].m_im;
  const btVector3 of_box = box->getLinearVelocity();
  CHECK(of_cloth.y() < btScalar(-0.05));
  CHECK((of_cloth + of_box).length() < btScalar(0.01) * of_cloth.length());
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("a state that is restored with a body near its place intersects nothing") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btSoftBody* const cloth = w.add_sheet(9, 1, 0.015, 0);
  const btVector3 half(btScalar(0.3), btScalar(0.2), btScalar(0.3));
  btRigidBody* const box =
      w.add(std::make_unique<btBoxShape>(half), btVector3(0, btScalar(-0.2), 0), 1);
  w.steps(4, tick);
  const btVector3 down(0, btScalar(-0.018), 0);
  box->translate(down);
  for (int i = 0; i < cloth->m_nodes.size(); ++i) {
    cloth->m_nodes[i].m_x += down;
    cloth->m_nodes[i].m_q += down;
  }
  w.steps(4, tick);
  CHECK(w.total().initial_intersections == 0);
  for (int i = 0; i < cloth->m_nodes.size(); ++i)
    CHECK(cloth->m_nodes[i].m_v.length() < btScalar(0.5));
}
