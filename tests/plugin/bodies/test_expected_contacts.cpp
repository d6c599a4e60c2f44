// Contacts of bodies whose own damping is strong. Damping is solved before contacts are found, and
// must know of those of the last step.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "bodies/expected_contacts.h"
#include "plugin/bodies/bullet_twin.h"
#include "plugin/support/soft_body_figures.h"
#include "plugin/support/tetrahedra.h"
#include "scenes/meshes/solid.h"

using namespace lazyccd;
using namespace lazyccd::bullet;
using namespace lazyccd::test;

namespace {

// A world with one block of rubber. Lengths in metres, masses in kg; y points up.
struct Rubber : DeformableTwin {
  btSoftBody* body = nullptr;

  using DeformableTwin::DeformableTwin;
  // `lowest`: the corner with the smallest coordinates; `modulus`: of elasticity, Pa; `damping`: in
  // seconds, as a fraction of the modulus.
  void add_block(const std::array<int, 3>& cells, double cell, const btVector3& lowest, double mass,
                 double modulus, double damping) {
    const auto at = [&](double u, double v, double w) {
      return lowest + btVector3(static_cast<btScalar>(u * cell * cells[0]),
                                static_cast<btScalar>(v * cell * cells[1]),
                                static_cast<btScalar>(w * cell * cells[2]));
    };
    body = add(scenes::make_solid(info(), cells, mass, at));
    orient_tetrahedra(*body);
    body->setActivationState(DISABLE_DEACTIVATION);
    body->m_cfg.collisions |= btSoftBody::fCollision::SDF_RDF;
    body->getCollisionShape()->setMargin(btScalar(0.001));
    body->m_cfg.kDF = 1;
    const auto lame = static_cast<btScalar>(modulus);
    make(std::make_unique<btDeformableNeoHookeanForce>(lame, lame, static_cast<btScalar>(damping)),
         {body});
    make(std::make_unique<btDeformableGravityForce>(btVector3(0, -10, 0)), {body});
  }
  btRigidBody* add_box(const btVector3& half, const btVector3& at, btScalar mass = 0) {
    btRigidBody* const box = add_rigid(std::make_unique<btBoxShape>(half), at, mass);
    box->setFriction(1);
    box->setActivationState(DISABLE_DEACTIVATION);
    return box;
  }
  void steps(int count, double dt) {
    for (int i = 0; i < count; ++i) step(static_cast<btScalar>(dt));
  }
  btVector3 centre() const {
    btVector3 sum(0, 0, 0);
    for (int i = 0; i < body->m_nodes.size(); ++i) sum += body->m_nodes[i].m_x;
    return sum / static_cast<btScalar>(body->m_nodes.size());
  }
  btVector3 momentum() const {
    btVector3 sum(0, 0, 0);
    for (int i = 0; i < body->m_nodes.size(); ++i)
      sum += body->m_nodes[i].m_v / body->m_nodes[i].m_im;
    return sum;
  }
};

// Height of the centre of a cube of 10 cm that has come to rest on a floor at y = 0.
double height_at_rest(double dt) {
  Rubber world(1);
  world.add_block({5, 5, 5}, 0.02, btVector3(0, btScalar(0.0015), 0), 0.1, 3000, 0.01);
  world.add_box(btVector3(1, btScalar(0.5), 1), btVector3(0, btScalar(-0.5), 0));
  world.steps(static_cast<int>(std::lround(0.3 / dt)), dt);
  return world.centre().y();
}

// A contact of a node with the top of a box. `impulse`: N s.
StepContact node_on_box(btSoftBody& body, int node, btRigidBody& box, double impulse) {
  StepContact contact;
  contact.kind = ContactKind::vertex_face;
  contact.body_a = &body;
  contact.body_b = &box;
  contact.nodes = {&body.m_nodes[node], nullptr, nullptr, nullptr};
  contact.weights = {1, -0.5, -0.25, -0.25};
  contact.point = body.m_nodes[node].m_x;
  contact.normal = btVector3(0, 1, 0);
  contact.impulse = impulse;
  contact.friction_impulse = btVector3(0, 0, 0);
  return contact;
}

// Numbers the nodes as Bullet's solver does. Returns their inverse masses, 1/kg.
std::vector<btScalar> number_nodes(btSoftBody& body) {
  std::vector<btScalar> inverse_mass;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    body.m_nodes[i].index = i;
    inverse_mass.push_back(body.m_nodes[i].m_im);
  }
  return inverse_mass;
}

}  // namespace

TEST_CASE("a soft slab that hangs over the edge of a box stays on it") {
  const int threads = GENERATE(1, 2);
  Rubber world(threads);
  world.add_block({20, 1, 4}, 0.015, btVector3(0, btScalar(0.0015), btScalar(-0.03)), 0.1, 3e4,
                  0.005);
  // 9 of 30 cm hang over.
  world.add_box(btVector3(1, btScalar(0.5), 1), btVector3(btScalar(1.09), btScalar(-0.5), 0));
  const btVector3 start = world.centre();
  world.steps(300, 1e-3);
  CHECK(std::abs(world.centre().x() - start.x()) < 1e-3);
  CHECK(world.centre().y() > start.y() - 5e-3);
}

TEST_CASE("how soft a body is at its contacts does not depend on the time step") {
  CHECK(std::abs(height_at_rest(1e-3) - height_at_rest(1e-4)) < 1e-4);
}

TEST_CASE("a damped body does not bounce off") {
  Rubber world(1);
  world.add_block({5, 5, 5}, 0.02, btVector3(0, btScalar(0.002), 0), 0.1, 3e4, 0.01);
  world.add_box(btVector3(1, btScalar(0.5), 1), btVector3(0, btScalar(-0.5), 0));
  world.body->setVelocity(btVector3(0, -2, 0));
  double fastest = 0;  // upwards, m/s
  for (int i = 0; i < 200; ++i) {
    world.step(btScalar(1e-3));
    fastest = std::max(fastest, static_cast<double>(world.momentum().y()) / 0.1);
  }
  CHECK(fastest < 0.2);
}

TEST_CASE("a damped body and a box keep their momentum when they collide") {
  Rubber world(1);
  world.add_block({4, 4, 4}, 0.025, btVector3(0, 0, 0), 0.1, 3e4, 0.01);
  world.dynamics->removeForce(world.body, world.forces.back().get());
  btRigidBody* const box =
      world.add_box(btVector3(btScalar(0.05), btScalar(0.05), btScalar(0.05)),
                    btVector3(btScalar(0.05), btScalar(0.155), btScalar(0.06)), 0.2f);
  box->setGravity(btVector3(0, 0, 0));
  box->setLinearVelocity(btVector3(0, -2, 0));
  world.steps(60, 1e-3);
  const btVector3 all = world.momentum() + btScalar(0.2) * box->getLinearVelocity();
  CHECK(world.momentum().y() < -0.05);  // they have met
  CHECK((all - btVector3(0, btScalar(-0.4), 0)).length() < 1e-4);
}

TEST_CASE("contacts are not expected if a node or what it touches is not as it was") {
  Rubber world(1);
  world.add_block({2, 2, 2}, 0.05, btVector3(0, 0, 0), 0.1, 3000, 0.01);
  btSoftBody& body = *world.body;
  btRigidBody* const box = world.add_box(btVector3(1, 1, 1), btVector3(0, -2, 0));
  StepContact contact = node_on_box(body, 3, *box, 1e-3);
  std::vector<btScalar> inverse_mass = number_nodes(body);
  ExpectedContacts contacts;
  ExpectedContacts::Bodies bodies;
  bodies.push_back(&body);
  const auto is_expected = [&] { return contacts.select(bodies, inverse_mass, btScalar(1e-3)); };
  contacts.take({&contact, 1}, {}, btScalar(1e-3));
  contacts.begin_step();
  contacts.meet(body, *box);
  CHECK(is_expected());
  box->translate(btVector3(0, btScalar(-0.004), 0));
  CHECK(is_expected());  // it moved on, at 4 m/s

  SECTION("the other body is gone or far away") { contacts.begin_step(); }
  SECTION("the other body was moved") { box->translate(btVector3(0, -1, 0)); }
  SECTION("the other body responds no longer") {
    box->setCollisionFlags(box->getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  }
  SECTION("moved") { body.m_nodes[3].m_x += btVector3(0, btScalar(1e-6), 0); }
  SECTION("pinned") { inverse_mass[3] = 0; }
  SECTION("asleep") { body.forceActivationState(ISLAND_SLEEPING); }
  SECTION("anchored") {
    body.appendDeformableAnchor(
        3, world.add_box(btVector3(1, 1, 1), body.m_nodes[3].m_x + btVector3(0, 2, 0)));
  }
  SECTION("removed") { bodies.clear(); }
  SECTION("moved apart") { contacts.take({&contact, 1}, {&body}, btScalar(1e-3)); }
  SECTION("without an impulse") {
    contact.impulse = 0;
    contacts.take({&contact, 1}, {}, btScalar(1e-3));
  }
  CHECK_FALSE(is_expected());
}

TEST_CASE("a damped body whose floor is taken away only falls") {
  Rubber world(1);
  world.add_block({2, 2, 2}, 0.1, btVector3(0, btScalar(0.001), 0), 1, 3000, 0.05);
  btRigidBody* const floor = world.add_box(btVector3(5, 1, 5), btVector3(0, -1, 0));
  world.steps(400, 1e-3);
  const bool is_far = GENERATE(false, true);
  CAPTURE(is_far);
  if (is_far) {
    floor->translate(btVector3(0, -50, 0));
  } else {
    world.world().removeRigidBody(floor);
  }
  world.steps(1, 1e-3);
  btScalar fastest = 0;
  for (int i = 0; i < world.body->m_nodes.size(); ++i)
    fastest = std::max(fastest, world.body->m_nodes[i].m_v.length());
  CHECK(fastest < 0.3);
}

TEST_CASE("a damped body is pushed alike by a heavy body and by one that is moved by hand") {
  constexpr double dt = 1.0 / 240;
  const auto speed_after = [&](bool by_hand) {
    Rubber world(1);
    world.add_block({5, 5, 5}, 0.02, btVector3(btScalar(-0.102), 0, 0), 0.1, 3000, 0.05);
    world.dynamics->removeForce(world.body, world.forces.back().get());
    btRigidBody* const pusher =
        world.add_box(btVector3(btScalar(0.05), btScalar(0.02), btScalar(0.02)),
                      btVector3(btScalar(0.05), btScalar(0.05), btScalar(0.05)), 1000);
    pusher->setGravity(btVector3(0, 0, 0));
    const btVector3 velocity(btScalar(-0.1), 0, 0);
    if (by_hand) {
      pusher->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    } else {
      pusher->setLinearVelocity(velocity);
    }
    for (int i = 0; i < 24; ++i) {
      if (by_hand) pusher->translate(static_cast<btScalar>(dt) * velocity);
      world.step(static_cast<btScalar>(dt));
    }
    return -static_cast<double>(world.momentum().x()) / 0.1;
  };
  const double by_hand = speed_after(true), by_bullet = speed_after(false);
  CHECK(by_bullet > 0.08);
  CHECK_THAT(by_hand, Matchers::WithinRel(by_bullet, 0.02));
}

TEST_CASE("an expected contact does not push what leaves it") {
  Rubber world(1);
  world.add_block({2, 2, 2}, 0.05, btVector3(0, 0, 0), 0.1, 3000, 0.01);
  btSoftBody& body = *world.body;
  btRigidBody* const box = world.add_box(btVector3(1, 1, 1), btVector3(0, -2, 0));
  // The impulse is as of a squeezed node.
  const StepContact contact = node_on_box(body, 0, *box, 1);
  const std::vector<btScalar> inverse_mass = number_nodes(body);
  ExpectedContacts::Bodies bodies;
  bodies.push_back(&body);
  ExpectedContacts contacts;
  contacts.take({&contact, 1}, {}, btScalar(1e-3));
  contacts.begin_step();
  contacts.meet(body, *box);
  REQUIRE(contacts.select(bodies, inverse_mass, btScalar(1e-3)));
  const btScalar twice_mass = 2 / inverse_mass[0];
  REQUIRE(contacts.find_penalties(
      [&](const VectorStack& x, VectorStack& b) {
        for (int i = 0; i < x.size(); ++i) b[i] = twice_mass * x[i];
      },
      body.m_nodes.size()));
  EquationIsland all;
  all.bodies = {0};
  contacts.divide({&all, 1});
  // Gravity has changed the speed by 1 cm/s.
  VectorStack velocity, dv;
  velocity.resize(body.m_nodes.size(), btVector3(0, btScalar(-0.01), 0));
  const auto [speed, is_dropped] = GENERATE(
      table<double, bool>({{-0.001, false}, {0, false}, {0.015, false}, {0.03, true}, {5, true}}));
  CAPTURE(speed);
  dv.resize(body.m_nodes.size(), btVector3(0, static_cast<btScalar>(speed + 0.01), 0));
  CHECK(contacts.drop_unlikely(0, velocity, dv) == is_dropped);
}

TEST_CASE("cloth between the ground and a plate that slides over it is not thrown off") {
  using Flag = btSoftBody::fCollision;
  DeformableTwin world(1);
  const auto at = [](double x, double z) {
    return btVector3(static_cast<btScalar>(x), btScalar(0.021), static_cast<btScalar>(z));
  };
  btSoftBody* const cloth = world.add(std::unique_ptr<btSoftBody>(btSoftBodyHelpers::CreatePatch(
      world.info(), at(-0.5, -0.5), at(0.5, -0.5), at(-0.5, 0.5), at(0.5, 0.5), 17, 17, 0, true)));
  cloth->m_cfg.collisions |= Flag::SDF_RDF;
  cloth->m_cfg.kDF = btScalar(0.5);
  cloth->setTotalMass(btScalar(0.4));
  cloth->getCollisionShape()->setMargin(btScalar(0.02));
  cloth->setActivationState(DISABLE_DEACTIVATION);
  world.make(std::make_unique<btDeformableMassSpringForce>(btScalar(16), btScalar(0.08), true),
             {cloth});
  world.make(std::make_unique<btDeformableGravityForce>(btVector3(0, -10, 0)), {cloth});
  world.add_rigid(std::make_unique<btBoxShape>(btVector3(20, 1, 20)), btVector3(0, -1, 0), 0);
  btRigidBody* const plate = world.add_rigid(
      std::make_unique<btBoxShape>(btVector3(btScalar(0.2), btScalar(0.05), btScalar(0.2))),
      btVector3(0, btScalar(0.15), 0), 0);
  plate->setCollisionFlags(plate->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  plate->setActivationState(DISABLE_DEACTIVATION);
  double fastest = 0;
  for (int i = 0; i < 480; ++i) {
    // It comes down at 0.5 m/s, to where there is room for a third of the margins.
    const double height = std::max(0.062, 0.15 - 0.5 * i / 240);
    const double slide = std::max(0.0, 0.3 * (i - 60) / 240);
    plate->setWorldTransform(
        btTransform(btQuaternion::getIdentity(),
                    btVector3(static_cast<btScalar>(slide), static_cast<btScalar>(height), 0)));
    world.step();
    fastest = std::max(fastest, speed(*cloth));
  }
  CHECK(fastest < 100);  // 969 m/s where contacts push what leaves them
}
