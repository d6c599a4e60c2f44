// Effects of the response on velocities: friction, restitution, rest, energy, two-way contact.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <cmath>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

double fastest(const btSoftBody& body) {
  double result = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    result = std::max(result, static_cast<double>(body.m_nodes[i].m_v.length()));
  }
  return result;
}

btVector3 mean_velocity(const btSoftBody& body) {
  btVector3 sum(0, 0, 0);
  for (int i = 0; i < body.m_nodes.size(); ++i) sum += body.m_nodes[i].m_v;
  return sum / static_cast<btScalar>(body.m_nodes.size());
}

// Adds a flat cloth of 1 kg without jitter.
btSoftBody* add_flat(ObstacleWorld& w, double height, double margin = 0.01) {
  auto cloth = scenes::make_cloth(w.info(), 5, 5, 1, [&](double u, double v) {
    return btVector3(static_cast<btScalar>(0.5 * u + 0.013), static_cast<btScalar>(height),
                     static_cast<btScalar>(0.5 * v + 0.017));
  });
  return w.add(std::move(cloth), margin);
}

struct Floor {
  std::unique_ptr<btTriangleMesh> triangles = flat_triangles(6, 12);
  btRigidBody* body;

  explicit Floor(ObstacleWorld& w, double friction = 0.5)
      : body(w.add(std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true),
                   btVector3(0, 0, 0))) {
    body->setFriction(static_cast<btScalar>(friction));
  }
};

}  // namespace

TEST_CASE("cloth comes to rest at its thickness above a mesh and above other cloth") {
  const World world = GENERATE(World::rigid, World::deformable);
  const int layers = GENERATE(1, 2);
  CAPTURE(world == World::rigid, layers);
  ObstacleWorld w(world, 10);
  Floor floor(w);
  std::vector<btSoftBody*> cloths;
  for (int i = 0; i < layers; ++i) cloths.push_back(add_flat(w, 0.03 * (i + 1) + 0.01));
  w.steps(150, 1.0 / 60);
  for (int i = 0; i < layers; ++i) {
    CHECK(fastest(*cloths[i]) < 1e-3);
    for (int n = 0; n < cloths[i]->m_nodes.size(); ++n) {
      CHECK_THAT(static_cast<double>(cloths[i]->m_nodes[n].m_x.y()),
                 Matchers::WithinAbs(0.02 * (i + 1), 0.005));
    }
  }
  CHECK(w.total().energy_gained < 1e-6);
}

TEST_CASE("thin cloth keeps its own thickness from the first contact beside a thick one") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  Floor floor(w);
  // One step of 4.2 mm takes it from above its thickness of 12 mm to below it.
  btSoftBody* thin = add_flat(w, 0.027, 0.002);
  add_flat(w, 1, 0.05);
  thin->setVelocity(btVector3(0, -1, 0));
  w.steps(10, 1.0 / 240);
  for (int n = 0; n < thin->m_nodes.size(); ++n) {
    CHECK_THAT(static_cast<double>(thin->m_nodes[n].m_x.y()), Matchers::WithinAbs(0.012, 1e-5));
  }
}

TEST_CASE("cloth without a margin keeps a gap larger than rounding errors at its position") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  constexpr btScalar far = 8192;
  ObstacleWorld w(world, 0);
  btSoftBody* const held = add_flat(w, 0, 0);
  btSoftBody* const falls = add_flat(w, 0.1, 0);
  scenes::pin(*held, 0, held->m_nodes.size() - 1);
  for (btSoftBody* const body : {held, falls}) body->translate(btVector3(far, 0, 0));
  falls->setVelocity(btVector3(0, -1, 0));
  w.steps(60, 1.0 / 240);
  REQUIRE(w.total().contacts_vf > 0);
  for (int n = 0; n < falls->m_nodes.size(); ++n)
    CHECK(falls->m_nodes[n].m_x.y() > 8 * SIMD_EPSILON * far);
}

TEST_CASE("friction holds cloth on a slope up to its coefficient and not on a steeper slope") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool holds = GENERATE(true, false);
  CAPTURE(world == World::rigid, holds);
  bullet::SolverOptions options;
  options.coulomb_friction = true;
  ObstacleWorld w(world, 0, options);
  Floor floor(w, 1);
  btSoftBody* cloth = add_flat(w, 0.021);
  cloth->m_cfg.kDF = holds ? btScalar(0.6) : btScalar(0.4);
  // Gravity is inclined by atan(0.5).
  const btVector3 weight(5, -10, 0);
  w.steps(60, 1.0 / 120, [&](int) {
    for (int i = 0; i < cloth->m_nodes.size(); ++i) cloth->m_nodes[i].m_v += weight / 120;
  });
  const double speed = static_cast<double>(mean_velocity(*cloth).x());
  // Kinetic: a = g (sin - mu cos) along the slope, here 5 - 0.4 * 10 over half a second.
  CHECK_THAT(speed, Matchers::WithinAbs(holds ? 0 : 0.5, holds ? 0.01 : 0.1));
}

TEST_CASE("friction between cloths combines coefficients as Bullet does in that world") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  bullet::SolverOptions options;
  options.coulomb_friction = true;
  ObstacleWorld w(world, 0, options);
  btSoftBody* const below = add_flat(w, 0);
  btSoftBody* const above = add_flat(w, 0.05);
  below->m_cfg.kDF = btScalar(0.5);
  above->m_cfg.kDF = btScalar(0.4);
  scenes::pin(*below, 0, below->m_nodes.size() - 1);
  above->setVelocity(btVector3(5, -5, 0));  // so that it slides
  const double coefficient = world == World::rigid ? 0.5 : 0.2;
  double most = 0;
  w.steps(6, 1.0 / 240, [&](int) {
    for (const bullet::StepContact& contact : w.contacts()) {
      const double across = static_cast<double>(contact.friction_impulse.length());
      CHECK(across <= 1.001 * coefficient * contact.impulse);
      if (contact.impulse > 0) most = std::max(most, across / contact.impulse);
    }
  });
  CHECK(most > 0.99 * coefficient);
}

TEST_CASE("the speed lost in a contact does not depend on the time scale of the body") {
  ObstacleWorld w(World::rigid, 0);
  Floor floor(w);
  btSoftBody* const cloth = add_flat(w, 0.03);
  cloth->m_cfg.timescale = btScalar(0.5);
  cloth->setVelocity(btVector3(0, -4, 0));
  for (int i = 0; i < 10 && w.total().contacts_vf == 0; ++i) w.steps(1);
  REQUIRE(w.total().contacts_vf > 0);
  // A part of the speed is left after the step in which it comes to rest.
  w.steps(1);
  CHECK(std::abs(static_cast<double>(mean_velocity(*cloth).y())) < 0.1);
}

TEST_CASE("a deformable moves in a step at most as far as its world allows") {
  ObstacleWorld w(World::deformable, 0);
  Floor floor(w);
  btSoftBody* const cloth = add_flat(w, 0.021);
  w.info().m_maxDisplacement = btScalar(0.002);
  cloth->setVelocity(btVector3(3, -3, 0));
  for (int i = 0; i < 5; ++i) {
    const btVector3 before = cloth->m_nodes[0].m_x;
    w.steps(1);
    CHECK((cloth->m_nodes[0].m_x - before).length() < btScalar(0.003));
  }
  CHECK(w.total().contacts_vf > 0);
}

TEST_CASE("a sleeping cloth wakes when it is pushed") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btSoftBody* const sleeper = add_flat(w, 0);
  add_flat(w, 0.05)->setVelocity(btVector3(0, -5, 0));
  w.steps(1);
  sleeper->forceActivationState(ISLAND_SLEEPING);
  for (int i = 0; i < 10 && w.last().contacts_vf == 0; ++i) {
    CHECK(!sleeper->isActive());
    w.steps(1);
  }
  CHECK(sleeper->isActive());
}

TEST_CASE("restitution returns its fraction of the speed and none by default") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double restitution = GENERATE(0.0, 0.5, 1.0);
  CAPTURE(world == World::rigid, restitution);
  bullet::SolverOptions options;
  options.restitution = restitution;
  ObstacleWorld w(world, 0, options);
  Floor floor(w);
  btSoftBody* cloth = add_flat(w, 0.1);
  cloth->setVelocity(btVector3(0, -4, 0));
  w.steps(20, 1.0 / 240);
  CHECK_THAT(static_cast<double>(mean_velocity(*cloth).y()),
             Matchers::WithinAbs(4 * restitution, 0.05));
  CHECK(w.total().energy_gained < 1e-3);
}

TEST_CASE("restitution keeps momentum where links are solved again after an impact") {
  bullet::SolverOptions options;
  options.restitution = 0.5;
  ObstacleWorld w(World::rigid, 0, options);
  // Both have one position iteration. The small sheet hits the other one off its centre.
  btSoftBody* large = w.add_sheet(13, 1, 0, 0);
  btSoftBody* small = w.add_sheet(5, 0.3, 0.2, 2);
  for (btSoftBody* sheet : {large, small}) {
    sheet->m_cfg.piterations = 1;
    sheet->m_cfg.kDP = 0;
  }
  small->translate(btVector3(btScalar(0.2), 0, btScalar(0.1)));
  small->setVelocity(btVector3(0, -4, 0));
  const auto momentum = [&] {
    return large->getTotalMass() * mean_velocity(*large) +
           small->getTotalMass() * mean_velocity(*small);
  };
  const btVector3 before = momentum();
  w.steps(12, 1.0 / 120);
  REQUIRE(w.total().contacts_vf > 0);
  CHECK((momentum() - before).length() < btScalar(1e-4) * before.length());
}

TEST_CASE("a dynamic rigid body and cloth exchange momentum and lose none") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double mass = GENERATE(0.05, 20.0);
  CAPTURE(world == World::rigid, mass);
  ObstacleWorld w(world, 0);
  btSoftBody* cloth = w.add_sheet(9, 1, 0, 0);
  cloth->m_cfg.kDP = 0;
  // So fast that Bullet's own contacts miss it.
  btRigidBody* ball = w.add(std::make_unique<btSphereShape>(btScalar(0.1)),
                            btVector3(btScalar(0.03), 1, btScalar(0.02)), mass);
  ball->setLinearVelocity(btVector3(0, -40, 0));
  ball->setActivationState(DISABLE_DEACTIVATION);
  w.steps(8, 1.0 / 60);
  const btVector3 momentum =
      static_cast<btScalar>(mass) * ball->getLinearVelocity() + mean_velocity(*cloth);
  CHECK_THAT(static_cast<double>(momentum.y()), Matchers::WithinAbs(-40 * mass, 1e-3 * 40 * mass));
  CHECK(static_cast<double>(mean_velocity(*cloth).y()) < -0.5);
  CHECK(w.total().energy_gained < 1e-3);
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("poses between two steps follow the velocity after the contacts") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  w.add_sheet(9, 1, 0, 0);
  btRigidBody* ball = w.add(std::make_unique<btSphereShape>(btScalar(0.1)),
                            btVector3(btScalar(0.03), btScalar(0.3), btScalar(0.02)), 0.5);
  ball->setLinearVelocity(btVector3(0, -5, 0));
  w.steps(6, 1.0 / 60);
  CHECK(static_cast<double>(ball->getLinearVelocity().y()) > -4.9);
  // Bullet extrapolates from the pose at the end of the step with these.
  CHECK(ball->getInterpolationLinearVelocity() == ball->getLinearVelocity());
  CHECK(ball->getInterpolationAngularVelocity() == ball->getAngularVelocity());
}

TEST_CASE("free bodies keep their angular momentum") {
  // Bullet's own steps keep angular momentum in the deformable world only.
  ObstacleWorld w(World::deformable, 0);
  btSoftBody* lower = w.add_sheet(9, 1, 0, 0);
  btSoftBody* upper = w.add_sheet(7, 0.7, 0.2, 0);
  upper->setVelocity(btVector3(3, -10, 2));
  double scale = 0;
  const auto angular_momentum = [&] {
    btVector3 sum(0, 0, 0);
    scale = 0;
    for (const btSoftBody* body : {lower, upper}) {
      for (int i = 0; i < body->m_nodes.size(); ++i) {
        const btSoftBody::Node& n = body->m_nodes[i];
        sum += n.m_x.cross(n.m_v) / n.m_im;
        scale += static_cast<double>(n.m_x.length() * n.m_v.length() / n.m_im);
      }
    }
    return sum;
  };
  const btVector3 before = angular_momentum();
  w.steps(20, 1.0 / 60);
  const btVector3 after = angular_momentum();
  CHECK(w.total().contacts_vf > 0);
  CHECK(static_cast<double>((after - before).length()) < 1e-4 * scale);
}

TEST_CASE("cloth that is crushed between two immovable bodies stays between them") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  Floor floor(w);
  auto triangles = flat_triangles(3, 4);
  btRigidBody* press = w.add(std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true),
                             btVector3(0, btScalar(0.5), 0));
  ObstacleWorld::make_kinematic(*press);
  btSoftBody* cloth = add_flat(w, 0.1);
  const auto press_to = [&](double height) {
    press->setWorldTransform(
        btTransform(btQuaternion::getIdentity(), btVector3(0, static_cast<btScalar>(height), 0)));
  };
  w.steps(30, 1.0 / 60, [&](int i) { press_to(0.5 - 0.02 * (i + 1)); });
  CHECK(w.total().failsafe_holds > 0);
  CHECK(w.total().unresolved == 0);
  CHECK(w.status().find("between bodies of infinite mass") != std::string::npos);
  // The press rises again. The cloth that it passed over is below it.
  w.steps(30, 1.0 / 60, [&](int i) { press_to(-0.1 + 0.02 * (i + 1)); });
  for (int i = 0; i < cloth->m_nodes.size(); ++i) {
    CHECK(cloth->m_nodes[i].m_x.y() > 0);
    CHECK(cloth->m_nodes[i].m_x.y() < btScalar(0.5));
  }
}

TEST_CASE("an object that is neither static nor a rigid body is treated as kinematic") {
  // Like the link of a multibody: it moves by itself, and contacts of LazyCCD do not move it.
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  auto triangles = flat_triangles(3, 4);
  btBvhTriangleMeshShape plate(triangles.get(), true);
  btCollisionObject press;
  ObstacleWorld w(world, 0);
  Floor floor(w);
  press.setCollisionShape(&plate);
  press.setCollisionFlags(0);
  const auto press_to = [&](double height) {
    press.setWorldTransform(
        btTransform(btQuaternion::getIdentity(), btVector3(0, static_cast<btScalar>(height), 0)));
  };
  press_to(0.5);
  w.world().addCollisionObject(&press);
  btSoftBody* cloth = add_flat(w, 0.1);
  w.steps(30, 1.0 / 60, [&](int i) { press_to(0.5 - 0.02 * i); });
  CHECK(w.total().failsafe_holds > 0);
  w.steps(30, 1.0 / 60, [&](int i) { press_to(-0.1 + 0.02 * (i + 1)); });
  for (int i = 0; i < cloth->m_nodes.size(); ++i) {
    CHECK(cloth->m_nodes[i].m_x.y() > 0);
    CHECK(cloth->m_nodes[i].m_x.y() < btScalar(0.5));
  }
  w.world().removeCollisionObject(&press);
}

TEST_CASE("a kinematic body that passes over a pinned node is not stopped by it") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  auto triangles = flat_triangles(3, 4);
  btRigidBody* plate = w.add(std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true),
                             btVector3(0, btScalar(0.5), 0));
  ObstacleWorld::make_kinematic(*plate);
  btSoftBody* cloth = add_flat(w, 0.1);
  cloth->setMass(0, 0);
  w.steps(30, 1.0 / 60, [&](int i) {
    plate->setWorldTransform(btTransform(
        btQuaternion::getIdentity(), btVector3(0, static_cast<btScalar>(0.5 - 0.02 * (i + 1)), 0)));
  });
  CHECK(w.total().unresolved > 0);
  // It pushes the far corner along.
  CHECK(cloth->m_nodes[cloth->m_nodes.size() - 1].m_x.y() < btScalar(-0.05));
}

TEST_CASE("a body woken in a step starts it where it slept") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btSoftBody* sleeper = add_flat(w, 0);
  sleeper->setVelocity(btVector3(0, 10, 0));
  w.steps(2, 1.0 / 60);
  for (int i = 0; i < sleeper->m_nodes.size(); ++i) sleeper->m_nodes[i].m_v.setZero();
  sleeper->forceActivationState(ISLAND_SLEEPING);
  const btScalar height = sleeper->m_nodes[0].m_x.y();
  // The other cloth lies where the sleeper moved in its last step; beside the sleeper it is as
  // high.
  btSoftBody* other = w.add(scenes::make_cloth(w.info(), 6, 3, 1, [height](double u, double v) {
    return btVector3(static_cast<btScalar>(u),
                     height + static_cast<btScalar>(u > 0.9 ? 0.05 : -0.08),
                     static_cast<btScalar>(0.4 * v - 0.2));
  }));
  w.steps(1, 1.0 / 60);
  CHECK(w.last().contacts_vf + w.last().contacts_ee == 0);
  for (const btSoftBody* body : {sleeper, other}) {
    for (int i = 0; i < body->m_nodes.size(); ++i) CHECK(body->m_nodes[i].m_v.length() < 1e-6);
  }
}

TEST_CASE("applications get all contacts of a step with their bodies") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  int calls = 0, with_floor = 0, listed = 0;
  double pushed = 0;
  bullet::SolverOptions options;
  const btCollisionObject* object = nullptr;
  options.on_contacts = [&](Span<const bullet::StepContact> contacts) {
    ++calls;
    for (const bullet::StepContact& c : contacts) {
      with_floor += c.body_a == object || c.body_b == object;
      // The normal points from the floor to the cloth above it.
      const bool upwards = (c.normal.y() > 0) == (c.body_b == object);
      CHECK(upwards);
      CHECK(std::abs(static_cast<double>(c.point.y())) < 0.05);
      pushed += c.impulse;
    }
  };
  ObstacleWorld w(world, 0, options);
  Floor floor(w);
  object = floor.body;
  btSoftBody* cloth = add_flat(w, 0.1);
  cloth->setVelocity(btVector3(0, -4, 0));
  for (int i = 0; i < 20; ++i) {
    w.steps(1);
    listed += cloth->m_rcontacts.size() + cloth->m_nodeRigidContacts.size();
  }
  CHECK(calls > 0);
  CHECK(with_floor > 0);
  CHECK(listed > 0);
  CHECK_THAT(pushed, Matchers::WithinAbs(4, 0.05));
}

TEST_CASE("a cloth that sleeps before its first step is pushed like an awake one") {
  ObstacleWorld w(World::rigid, 0);
  btSoftBody* sleeper = add_flat(w, 0);
  sleeper->forceActivationState(ISLAND_SLEEPING);
  btSoftBody* thrown = w.add_sheet(6, 1, 0.1, 5);
  const double before = -5 * static_cast<double>(thrown->getTotalMass());
  w.steps(24);
  CHECK(w.total().contacts_vf + w.total().contacts_ee > 0);
  CHECK(mean_velocity(*sleeper).y() < -0.5);
  const auto momentum = [](const btSoftBody& body) {
    double sum = 0;
    for (int i = 0; i < body.m_nodes.size(); ++i)
      sum += static_cast<double>(body.m_nodes[i].m_v.y() / body.m_nodes[i].m_im);
    return sum;
  };
  CHECK(momentum(*sleeper) + momentum(*thrown) == Approx(before).epsilon(1e-3));
}

TEST_CASE("different damping of bodies far from the origin causes no rotation") {
  // Bullet applies this damping to cloth but not to rigid bodies.
  const double far = GENERATE(0.0, 1000.0);
  CAPTURE(far);
  ObstacleWorld w(World::rigid, 0);
  btRigidBody* box = w.add(std::make_unique<btBoxShape>(btVector3(1, 1, 1)),
                           btVector3(static_cast<btScalar>(far), -1, 0), 1);
  btSoftBody* cloth = w.add_sheet(6, 1, 0.1, 2);
  cloth->translate(btVector3(static_cast<btScalar>(far), 0, 0));
  cloth->m_cfg.kDP = btScalar(0.05);
  w.steps(30);
  CHECK(w.total().contacts_vf > 0);
  CHECK(box->getLinearVelocity().y() < -0.3);
  CHECK(box->getAngularVelocity().length() < 0.05);
}

TEST_CASE("an exception in on_contacts is caught and logged") {
  bullet::SolverOptions options;
  options.on_contacts = [](Span<const bullet::StepContact>) { throw 1; };
  ObstacleWorld w(World::rigid, 0, options);
  add_flat(w, 0);
  w.add_sheet(6, 1, 0.1, 5);
  w.steps(24);
  CHECK(w.total().fallback_steps == 0);
  CHECK(w.status().find("on_contacts threw") != std::string::npos);
}

TEST_CASE("energy is measured on request, and nothing moves differently") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  scenes::WorldOptions options = quiet_options(world);
  Impact measured(options);
  options.lazyccd.measure_energy = false;
  Impact unmeasured(options);
  measured.steps(12);
  unmeasured.steps(12);
  CHECK(measured.world->total_stats()->energy_lost > 0);
  CHECK(unmeasured.world->total_stats()->energy_lost == 0);
  CHECK(unmeasured.world->total_stats()->energy_gained == 0);
  for (int i = 0; i < measured.thrown->m_nodes.size(); ++i)
    CHECK(measured.thrown->m_nodes[i].m_x == unmeasured.thrown->m_nodes[i].m_x);
}
