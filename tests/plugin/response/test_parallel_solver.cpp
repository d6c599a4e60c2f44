#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "plugin/support/contacts.h"
#include "response/contact_constraints.h"
#include "support/catch.h"

using namespace lazyccd;
using bullet::Vector3d;

namespace {

// Two sheets of nodes above each other fall on a plate, a dynamic rigid body that flies freely.
// Each node of the upper sheet meets a face of the lower one, and each node of the lower one the
// plate.
struct Pile {
  static constexpr int side = 70;
  static constexpr double spacing = 0.1, height = 0.05, speed = 1;
  bullet::Motion motion;
  std::vector<Contact> contacts;
  std::vector<btVector3> corners;

  // `node_mass`, `plate_mass`: kg.
  Pile(double node_mass, double plate_mass) {
    motion.input().dt = 0.01;
    const auto add_vertex = [&](double x, double y, double z) {
      for (const double value : {x, y, z})
        motion.input().start.push_back(static_cast<btScalar>(value));
    };
    for (int sheet = 0; sheet < 2; ++sheet) {
      for (int i = 0; i < side * side; ++i) {
        add_vertex(spacing * (i % side), height * (2 - sheet), spacing * (i / side));
        motion.input().inverse_mass.push_back(1 / node_mass);
        motion.input().shortest_edge.push_back(spacing);
      }
    }
    const double width = spacing * side;
    const std::int32_t plate = motion.soft_count();
    corners = {btVector3(-1, 0, -1), btVector3(btScalar(3 * width), 0, -1),
               btVector3(-1, 0, btScalar(3 * width))};
    for (const btVector3& x : corners) add_vertex(x.x(), 0, x.z());
    const auto add = [&](std::int32_t a, std::int32_t b, const std::array<std::int32_t, 4>& v,
                         float u) {
      Contact contact = lazyccd::test::contact(ContactKind::vertex_face, v, u, u);
      contact.body_a = a;
      contact.body_b = b;
      contact.primitive_a = v[0];
      contact.primitive_b = static_cast<std::int32_t>(contacts.size());
      contacts.push_back(contact);
    };
    for (int i = 0; i < side * side; ++i) {
      if (i % side + 1 == side || i / side + 1 == side) continue;
      const std::int32_t below = side * side + i;
      add(0, 1, {i, below, below + 1, below + side}, 0.3f);
    }
    for (int i = 0; i < side * side; ++i)
      add(1, 2, {side * side + i, plate, plate + 1, plate + 2}, 0.2f);
    std::sort(contacts.begin(), contacts.end());
    bullet::RigidMotion body = {};
    body.first_vertex = plate;
    body.vertex_count = 3;
    body.start.setIdentity();
    body.start.setOrigin(btVector3(btScalar(width / 2), 0, btScalar(width / 2)));
    body.predicted = body.end = body.start;
    for (btVector3& x : corners) x -= body.start.getOrigin();
    body.local = corners.data();
    body.inverse_mass = Vector3d::Constant(1 / plate_mass);
    body.inverse_inertia = 12 / (plate_mass * width * width) * bullet::Matrix3d::Identity();
    motion.input().rigid.push_back(body);
    motion.input().first_vertex = {0, side * side, 2 * side * side, 2 * side * side + 3};
    motion.input().rigid_of_body = {-1, -1, 0};
    motion.input().velocity.assign(motion.inverse_mass().size(), Vector3d(0, -speed, 0));
    motion.input().rate.assign(motion.inverse_mass().size(), 1 / motion.dt());
    motion.end = motion.start();
    for (std::int32_t v = 0; v < motion.soft_count(); ++v)
      motion.end[3 * static_cast<std::size_t>(v) + 1] -= static_cast<btScalar>(speed * motion.dt());
    motion.begin_response();
  }

  // Largest violation of a contact, metres.
  double violation(bullet::RowList& rows) const {
    double largest = 0;
    for (std::size_t i = 0; i < rows.size(); ++i)
      largest = std::max(
          largest, rows[i].target_gap - rows[i].normal.dot(gap_vector_at_end(rows[i], motion)));
    return largest;
  }
};

std::vector<double> solve(Pile& pile, int threads, int sweeps) {
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(Pile::height, 0.3);
  bullet::ContactConstraints constraints(surfaces, 0.05, Threads(threads));
  constraints.begin_step();
  constraints.add(pile.contacts, pile.motion);
  constraints.solve(pile.motion, sweeps);
  // Once more, from the impulses that the rows have now.
  constraints.solve(pile.motion, sweeps);
  std::vector<double> result = {pile.violation(constraints.rows())};
  for (std::size_t i = 0; i < constraints.rows().size(); ++i)
    result.push_back(constraints.rows()[i].normal_impulse);
  for (const Vector3d& x : pile.motion.solved) result.insert(result.end(), x.data(), x.data() + 3);
  for (const btScalar x : pile.motion.end) result.push_back(static_cast<double>(x));
  return result;
}

}  // namespace

TEST_CASE("the result of the contact solver does not depend on the number of threads") {
  const double plate_mass = GENERATE(0.001, 1.0, 1000.0);
  CAPTURE(plate_mass);
  Pile first(0.001, plate_mass);
  const std::vector<double> expected = solve(first, 1, 20);
  for (const int threads : {2, 3, 16}) {
    Pile pile(0.001, plate_mass);
    CHECK(solve(pile, threads, 20) == expected);
  }
}

TEST_CASE("a body that is held at its supports moves as they let it, on any number of threads") {
  const double plate_mass = GENERATE(0.001, 1.0);
  CAPTURE(plate_mass);
  const auto held_pile = [plate_mass] {
    Pile pile(0.001, plate_mass);
    bullet::RigidMotion& plate = pile.motion.input().rigid[0];
    plate.supported_mobility = bullet::free_mobility(plate);
    for (int i = 0; i < 6; ++i)
      (*plate.supported_mobility)(i, 1) = (*plate.supported_mobility)(1, i) = 0;
    return pile;
  };
  Pile first = held_pile();
  const std::vector<double> expected = solve(first, 1, 400);
  CHECK(expected[0] < 0.01 * Pile::speed * first.motion.dt());
  CHECK(first.motion.rigid()[0].translation.y() == 0);
  CHECK(first.motion.rigid()[0].rotation.norm() > 0);
  Pile second = held_pile();
  CHECK(solve(second, 3, 400) == expected);
}

TEST_CASE("thousands of contacts with one rigid body converge and keep momentum") {
  // From much lighter than the nodes on it, 9.8 kg together, to much heavier.
  const double plate_mass = GENERATE(0.01, 1.0, 10.0, 10000.0);
  CAPTURE(plate_mass);
  constexpr double node_mass = 0.001;
  Pile pile(node_mass, plate_mass);
  const double violation = solve(pile, 2, 400)[0];
  CHECK(violation < 0.01 * Pile::speed * pile.motion.dt());
  Vector3d momentum = plate_mass * pile.motion.rigid()[0].translation;  // times the time step
  for (std::size_t v = 0; v < pile.motion.solved.size(); ++v)
    momentum += node_mass * (pile.motion.solved[v] - pile.motion.predicted[v]);
  CHECK(momentum.norm() < 1e-9);
  CHECK(pile.motion.rigid()[0].translation.y() < 0);
}

TEST_CASE("many contacts at one place are solved") {
  Pile pile(0.001, 1);
  // The same node meets the plate in every contact, so that all blocks share it.
  const Contact one = pile.contacts.back();
  pile.contacts.assign(pile.contacts.size(), one);
  for (std::size_t i = 0; i < pile.contacts.size(); ++i)
    pile.contacts[i].primitive_b = static_cast<std::int32_t>(i);
  CHECK(solve(pile, 2, 100)[0] < 0.01 * Pile::speed * pile.motion.dt());
}
