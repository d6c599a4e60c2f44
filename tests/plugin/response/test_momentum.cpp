#include <array>
#include <cmath>
#include <vector>

#include "detection/near_contact_selector.h"
#include "plugin/support/column.h"
#include "plugin/support/contacts.h"
#include "response/contact_constraints.h"
#include "response/impact_zones.h"
#include "response/response.h"
#include "scenes/measures/mechanics.h"
#include "scenes/scene.h"
#include "support/catch.h"
#include "util/matrix.h"

using namespace lazyccd;
using lazyccd::test::Column;
using scenes::World;

namespace {

// Largest change of the total momentum during `steps` steps of the scene free-cloths, relative to
// the sum of the nodes' absolute momenta at the start.
double momentum_error(World world, const bullet::SolverOptions& options, int steps,
                      bullet::StepStats* stats) {
  scenes::Parameters parameters;
  parameters.world = world;
  parameters.speed = 30;
  parameters.dt = 1.0 / 60;
  parameters.lazyccd = options;
  scenes::Scene scene = scenes::set_up(*scenes::find_scene("free-cloths"), parameters);
  // Bullet's own damping would reduce the momentum.
  for (const auto& body : scene.world->bodies()) body->m_cfg.kDP = 0;
  const scenes::Mechanics start = scenes::measure(*scene.world);
  double worst = 0;
  for (int i = 0; i < steps; ++i) {
    scene.world->step();
    const scenes::Mechanics now = scenes::measure(*scene.world);
    for (int k = 0; k < 3; ++k) {
      worst = std::max(worst, std::abs(now.momentum[k] - start.momentum[k]) / start.impulse_scale);
    }
  }
  *stats = *scene.world->total_stats();
  return worst;
}

}  // namespace

TEST_CASE("impulses keep the momentum of free bodies") {
  const World world = GENERATE(World::rigid, World::deformable);
  bullet::StepStats stats;
  CHECK(momentum_error(world, {}, 20, &stats) < 1e-5);
  CHECK(stats.contacts_vf > 0);
  CHECK(stats.contacts_ee > 0);
  CHECK(stats.failsafe_holds == 0);
}

TEST_CASE("the response keeps linear and angular momentum whatever Bullet's own step does") {
  scenes::Parameters parameters;
  parameters.world = GENERATE(World::rigid, World::deformable);
  parameters.speed = 30;
  parameters.dt = 1.0 / 60;
  parameters.size = 0.5;
  const scenes::SceneInfo& info = *scenes::find_scene("free-cloths");
  scenes::Scene scene = scenes::set_up(info, parameters), alone = scenes::set_up(info, parameters);
  const auto& bodies = scene.world->bodies();
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    btSoftBody& twin = *alone.world->bodies()[b];
    twin.setCollisionFlags(twin.getCollisionFlags() | btCollisionObject::CF_NO_CONTACT_RESPONSE);
  }
  for (int step = 0; step < scene.steps; ++step) {
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      for (int i = 0; i < bodies[b]->m_nodes.size(); ++i) {
        const btSoftBody::Node& node = bodies[b]->m_nodes[i];
        btSoftBody::Node& twin = alone.world->bodies()[b]->m_nodes[i];
        twin.m_x = node.m_x;
        twin.m_q = node.m_q;
        twin.m_v = node.m_v;
      }
    }
    scene.world->step();
    alone.world->step();
    const scenes::Mechanics with = scenes::measure(*scene.world);
    const scenes::Mechanics without = scenes::measure(*alone.world);
    for (int k = 0; k < 3; ++k) {
      // All bodies are within about a metre of the origin.
      CHECK(std::abs(with.momentum[k] - without.momentum[k]) < 1e-6 * without.impulse_scale);
      CHECK(std::abs(with.angular_momentum[k] - without.angular_momentum[k]) <
            1e-6 * without.impulse_scale);
    }
  }
  CHECK(scene.world->total_stats()->contacts_vf > 0);
}

TEST_CASE("impact zones keep the momentum of free bodies") {
  const World world = GENERATE(World::rigid, World::deformable);
  bullet::SolverOptions options;
  options.max_impulse_rounds = 0;
  options.max_zone_rounds = 30;
  bullet::StepStats stats;
  CHECK(momentum_error(world, options, 8, &stats) < 1e-5);
  CHECK(stats.impact_zone_nodes > 0);
  CHECK(stats.failsafe_holds == 0);
}

TEST_CASE("impulses of a contact between very different masses sum to zero") {
  const ContactKind kind = GENERATE(ContactKind::vertex_face, ContactKind::edge_edge);
  bullet::Motion motion;
  motion.input().start = {0, 1, 0, -1, 0, -1, 1, 0, -1, 0, 0, 1};
  motion.end = motion.start();
  motion.end[1] = -3;
  motion.input().inverse_mass = {1e3, 1e-3, 1, 20};
  motion.input().shortest_edge = {1, 1, 1, 1};
  motion.input().first_vertex = {0, 4};
  motion.input().rigid_of_body = {-1};
  if (kind == ContactKind::edge_edge) {
    motion.input().start = {-1, 1, 0, 1, 1, 0, 0, 0, -1, 0, 0, 1};
    motion.end = motion.start();
    motion.end[1] = motion.end[4] = -3;
  }
  motion.begin_response();
  Contact contact = {};
  contact.kind = kind;
  contact.vertices = {0, 1, 2, 3};
  contact.u = contact.v = 0.3f;
  contact.normal = {0, 1, 0};
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0);
  bullet::ContactConstraints rows(surfaces, 0.05);
  rows.add({contact}, motion);
  rows.solve(motion, 10);

  bullet::Vector3d impulse = bullet::Vector3d::Zero();
  double gap = 0, largest = 0;
  const auto weights = contact.weights();
  for (int i = 0; i < 4; ++i) {
    const bullet::Vector3d one =
        (motion.solved[i] - motion.predicted[i]) / motion.inverse_mass()[i];
    impulse += one;
    largest = std::max(largest, one.norm());
    gap += weights[i] * motion.solved[i].y();
  }
  CHECK(largest > 0);
  CHECK(impulse.norm() < 1e-8 * largest);
  CHECK_THAT(gap, Matchers::WithinAbs(0.1, 1e-6));
}

TEST_CASE("a point that falls on a light resting point bounces and leaves it at rest") {
  const double restitution = GENERATE(0.5, 1.0), falls = 2;
  Column column({10, 1});
  bullet::Motion& motion = column.motion;
  motion.input().rate.assign(9, 1 / motion.dt());
  motion.input().velocity.assign(9, bullet::Vector3d::Zero());
  motion.input().velocity[6].y() = -falls;
  motion.end[3 * 6 + 1] -= static_cast<btScalar>(falls * motion.dt());
  bullet::SolverOptions options;
  options.restitution = restitution;
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0);
  bullet::Response response(options, surfaces);
  bullet::NearContactSelector near(surfaces, options.position_correction,
                                   [](std::int32_t, std::int32_t) { return true; });
  bullet::StepStats stats;
  response.run(
      near.evaluate_all(column.contacts, motion), {},
      [](const Positions&, const Positions&) { return std::vector<Contact>(); }, {}, motion, stats);
  const auto speed = [&](std::int32_t v) {
    return (motion.velocity()[v] + motion.velocity_change[v]).y();
  };
  CHECK_THAT(speed(6), Matchers::WithinAbs(falls * restitution, 0.05 * falls));
  CHECK_THAT(speed(3), Matchers::WithinAbs(0, 0.05 * falls));
}

TEST_CASE("a body on rails is stopped by a pinned node beside contacts of other bodies") {
  // A pinned vertex above a face of a rigid body that can move along y only, and a vertex above a
  // face of a soft body.
  const btVector3 local[] = {btVector3(-1, 0, -1), btVector3(1, 0, -1), btVector3(0, 0, 1)};
  bullet::Motion motion;
  motion.input().start = {0, 1, 0, 5,  1, 0,  4, 0, -1, 6, 0, -1,
                          5, 0, 1, -1, 0, -1, 1, 0, -1, 0, 0, 1};
  motion.end = motion.start();
  motion.end[4] = -1;
  motion.input().inverse_mass = {0, 1, 1, 1, 1};
  motion.input().shortest_edge = {1, 1, 1, 1, 1};
  motion.input().first_vertex = {0, 1, 2, 5, 8};
  motion.input().rigid_of_body = {-1, -1, -1, 0};
  bullet::RigidMotion body;
  body.first_vertex = 5;
  body.vertex_count = 3;
  body.local = local;
  body.start.setIdentity();
  body.predicted.setIdentity();
  body.predicted.getOrigin().setY(btScalar(1.5));
  body.velocity = body.angular_velocity = body.velocity_change = body.angular_velocity_change =
      bullet::Vector3d::Zero();
  body.inverse_mass = bullet::Vector3d(0, 0.5, 0);
  body.inverse_inertia.setZero();
  motion.input().rigid.push_back(body);
  motion.set_end_pose(motion.rigid()[0], body.predicted);
  motion.begin_response();

  Contact on_rails = {}, soft = {};
  on_rails.vertices = {0, 5, 6, 7};
  on_rails.body_b = 3;
  soft.vertices = {1, 2, 3, 4};
  soft.body_a = 1;
  soft.body_b = 2;
  for (Contact* contact : {&on_rails, &soft}) {
    contact->kind = ContactKind::vertex_face;
    contact->u = 0.25f;
    contact->v = 0.5f;
    contact->normal = {0, 1, 0};
  }
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0.5);
  bullet::ContactConstraints rows(surfaces, 0.05);
  rows.add({on_rails, soft}, motion);
  rows.solve(motion, 100);
  CHECK_THAT(static_cast<double>(motion.rigid()[0].end.getOrigin().y()),
             Matchers::WithinAbs(0.9, 1e-6));
  const double gap = motion.solved[1].y() - 0.25 * motion.solved[2].y() -
                     0.25 * motion.solved[3].y() - 0.5 * motion.solved[4].y();
  CHECK_THAT(gap, Matchers::WithinAbs(0.1, 1e-6));
}

namespace {

// Four nodes in contact, and a fifth node of the same body.
struct FourInContact {
  bullet::Motion motion;
  Contact contact = {};

  FourInContact() {
    motion.input().start = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 2, 0};
    motion.end = {0, 0, 0, 1, btScalar(0.2), 0, 1, 1, 0, 0, 1, btScalar(0.1), 2, btScalar(2.1), 0};
    motion.input().inverse_mass = {1, 2, 1, 0.5, 1};
    motion.input().first_vertex = {0, 5};
    motion.input().rigid_of_body = {-1};
    motion.begin_response();
    contact.vertices = {0, 1, 2, 3};
  }
  int count_at_start() const {
    int count = 0;
    for (int v = 0; v < 5; ++v) count += motion.end_of(v) == motion.start_of(v);
    return count;
  }
  // Linear and angular momentum of the motion to these ends.
  std::array<bullet::Vector3d, 2> momenta(const std::vector<bullet::Vector3d>& ends) const {
    std::array<bullet::Vector3d, 2> sums = {bullet::Vector3d::Zero(), bullet::Vector3d::Zero()};
    for (int v = 0; v < 5; ++v) {
      const bullet::Vector3d start = motion.start_of(v);
      const bullet::Vector3d momentum = (ends[v] - start) / motion.inverse_mass()[v];
      sums[0] += momentum;
      sums[1] += start.cross(momentum);
    }
    return sums;
  }
  void check_momenta() const {
    const auto before = momenta(motion.predicted), after = momenta(motion.solved);
    CHECK((after[0] - before[0]).norm() < 1e-12);
    CHECK((after[1] - before[1]).norm() < 0.03 * before[1].norm());  // it rotates by 0.1 rad
  }
};

}  // namespace

TEST_CASE("a zone rotates as a rigid body and keeps linear and angular momentum") {
  FourInContact four;
  bullet::Motion& motion = four.motion;
  bullet::ImpactZones zones(motion);
  zones.absorb({four.contact}, motion);
  CHECK(zones.node_count() == 4);
  CHECK(zones.held_count() == 0);
  CHECK(four.count_at_start() == 0);
  four.check_momenta();
  for (int i = 1; i < 4; ++i) {
    const double was = (motion.start_of(i) - motion.start_of(0)).norm();
    CHECK_THAT((motion.solved[i] - motion.solved[0]).norm(), Matchers::WithinAbs(was, 1e-12));
  }
}

TEST_CASE("a held zone ends where the step began and keeps its momenta") {
  const bool whole_bodies = GENERATE(false, true);
  CAPTURE(whole_bodies);
  FourInContact four;
  bullet::Motion& motion = four.motion;
  bullet::ImpactZones zones(motion);
  CHECK(zones.hold({four.contact}, whole_bodies, motion));
  const int held = whole_bodies ? 5 : 4;
  CHECK(zones.held_count() == held);
  CHECK(four.count_at_start() == held);
  four.check_momenta();
  CHECK(!zones.hold({four.contact}, whole_bodies, motion));
}

TEST_CASE("a zone turns a body that nodes of it are anchored to only if there are several") {
  const bool several = GENERATE(false, true);
  CAPTURE(several);
  FourInContact four;
  bullet::Motion& motion = four.motion;
  const std::vector<double> masses = {1, 2, 1, 2, 1};  // node 1 is anchored to a body of 2 kg
  bullet::RigidMotion body = {};
  body.start.setIdentity();
  body.start.setOrigin(btVector3(1, 0, btScalar(0.5)));
  body.predicted = body.start;
  body.predicted.getOrigin() += btVector3(0, btScalar(0.2), 0);
  body.velocity = body.angular_velocity = bullet::Vector3d::Zero();
  body.inverse_mass = bullet::Vector3d::Constant(0.5);
  body.inverse_inertia = 10 * bullet::Matrix3d::Identity();
  motion.input().rigid.push_back(body);
  const auto anchor = [&](std::int32_t v) {
    motion.input().inverse_mass[v] = 0;
    motion.input().anchor(v, {bullet::to_bullet(motion.start_of(v)) - body.start.getOrigin(), 0});
  };
  anchor(1);
  if (several) anchor(2);
  motion.begin_response();
  bullet::ImpactZones zones(motion);
  CHECK(zones.absorb({four.contact}, motion));
  CHECK(!zones.absorb({four.contact}, motion));

  CHECK((motion.rigid()[0].rotation.norm() > 0.01) == several);
  CHECK((motion.rigid()[0].end.getBasis() == body.start.getBasis()) == !several);
  for (int i = 0; i < 4; ++i) {
    const double side = (motion.solved[i] - motion.solved[(i + 1) % 4]).norm();
    CHECK_THAT(side, Matchers::WithinAbs(1, 1e-6));
  }
  if (several) return;
  bullet::Vector3d linear = bullet::Vector3d::Zero(), angular = linear, before = linear;
  for (int v = 0; v < 4; ++v) {
    const bullet::Vector3d x = motion.start_of(v);
    linear += masses[v] * (motion.solved[v] - motion.predicted[v]);
    angular += masses[v] * x.cross(motion.solved[v] - motion.predicted[v]);
    before += masses[v] * x.cross(motion.predicted[v] - x);
  }
  CHECK(linear.norm() < 1e-6);
  CHECK(angular.norm() < 0.03 * before.norm());
}
