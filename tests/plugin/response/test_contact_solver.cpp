#include <algorithm>
#include <vector>

#include "plugin/support/column.h"
#include "plugin/support/contacts.h"
#include "response/contact_constraints.h"
#include "response/crowding.h"
#include "support/catch.h"

using namespace lazyccd;
using lazyccd::test::Column;

namespace {

// Bodies of two nodes above a pinned one each, with a contact between neighbours.
struct Stacks {
  bullet::Motion motion;
  std::vector<Contact> contacts;

  explicit Stacks(std::int32_t bodies) {
    motion.input().first_vertex = {0};
    for (std::int32_t body = 0; body < bodies; ++body) {
      Column column({1, 1});
      const std::int32_t first = motion.soft_count();
      for (Contact& contact : column.contacts) {
        contact.body_a = contact.body_b = body;
        contact.primitive_a += first;
        for (std::int32_t& v : contact.vertices) v += first;
        contacts.push_back(contact);
      }
      const auto append = [](auto& to, const auto& from) {
        to.insert(to.end(), from.begin(), from.end());
      };
      append(motion.input().start, column.motion.start());
      append(motion.input().inverse_mass, column.motion.inverse_mass());
      append(motion.input().shortest_edge, column.motion.shortest_edge());
      motion.input().first_vertex.push_back(motion.soft_count());
      motion.input().rigid_of_body.push_back(-1);
    }
    motion.input().dt = 0.01;
    motion.end = motion.start();
  }
  // Moves the free nodes of a body down by 1 cm.
  void load(std::int32_t body) {
    const std::int32_t first = motion.first_vertex()[body];
    for (const std::int32_t v : {first + 3, first + 6})
      motion.end[3 * static_cast<std::size_t>(v) + 1] -= btScalar(0.01);
  }
  void begin(bullet::ContactConstraints& rows) {
    motion.begin_response();
    rows.begin_step();
    rows.add(contacts, motion);
  }
};

}  // namespace

TEST_CASE("an island that needs no impulse leaves the others as they are") {
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0);
  bullet::ContactConstraints rows(surfaces, 0.05);
  Stacks stacks(2);
  stacks.load(1);
  stacks.begin(rows);
  rows.solve(stacks.motion, 100);
  const std::vector<bullet::Vector3d> solved = stacks.motion.solved;
  REQUIRE(solved != stacks.motion.predicted);
  bullet::RowIslands& islands = rows.islands(stacks.motion);
  REQUIRE(islands.count() == 2);
  islands.select_none();
  islands.select_body(0);
  rows.solve(stacks.motion, 100);
  CHECK(stacks.motion.solved == solved);
}

TEST_CASE("a scene that got smaller and needs no impulse is left as it is") {
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0);
  bullet::ContactConstraints rows(surfaces, 0.05);
  Stacks many(8);
  many.load(7);
  many.begin(rows);
  rows.solve(many.motion, 100);
  rows.forget();
  Stacks one(1);
  one.begin(rows);
  rows.solve(one.motion, 100);
  CHECK(one.motion.solved == one.motion.predicted);
  CHECK(one.motion.end == one.motion.start());
}

TEST_CASE("crowded contacts of one island do not end the rounds of another") {
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0);
  bullet::ContactConstraints rows(surfaces, 0.05);
  Stacks stacks(2);
  stacks.begin(rows);
  const bullet::RowIslands& islands = rows.islands(stacks.motion);
  REQUIRE(islands.count() == 2);
  std::vector<Contact> contacts;
  for (const Contact& contact : stacks.contacts)
    contacts.insert(contacts.end(), contact.body_a == 0 ? 60 : 1, contact);
  bullet::Crowding crowding(2);
  for (int round = 0; round < 4; ++round) crowding.add_round(contacts, islands);
  CHECK_FALSE(crowding.is_given_up(contacts.front()));
  crowding.add_round(contacts, islands);
  CHECK(crowding.is_given_up(contacts.front()));
  CHECK_FALSE(crowding.is_given_up(contacts.back()));
}

TEST_CASE("a resting load is solved to rest at any force") {
  constexpr int points = 30;
  Column column(std::vector<double>(points - 1, 1));
  bullet::Motion& motion = column.motion;
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0);
  bullet::ContactConstraints rows(surfaces, 0.05);
  const auto fall = [&](double metres, int sweeps) {
    motion.end = motion.start();
    for (std::size_t i = 1; i < points; ++i) motion.end[9 * i + 1] -= static_cast<btScalar>(metres);
    motion.begin_response();
    rows.begin_step();
    rows.add(column.contacts, motion);
    rows.warm_start();
    rows.solve(motion, sweeps);
  };
  fall(0.0100, 10000);
  // 1 cm/s faster than before, with 30 sweeps: less than 1 mm/s is left.
  fall(0.0101, 30);
  double fastest = 0;
  for (std::int32_t i = 1; i < points; ++i)
    fastest = std::max(fastest, (motion.solved[3 * i] - motion.start_of(3 * i)).norm() / 0.01);
  CHECK(fastest < 1e-3);
}

TEST_CASE("contacts go on after links have moved nodes as if they were set up anew") {
  constexpr int points = 30;
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0);
  const auto solve_in_turns = [&](bool anew) {
    Column column(std::vector<double>(points - 1, 1));
    bullet::Motion& motion = column.motion;
    bullet::ContactConstraints rows(surfaces, 0.05);
    const auto move_by_links = [&](int i, double height) {
      motion.link_displacement[3 * i].y() += height;
      motion.solved[3 * i].y() += height;
      motion.links_moved.assign(1, 1);
    };
    for (std::size_t i = 1; i < points / 2; ++i) motion.end[9 * i + 1] -= btScalar(0.01);
    motion.begin_response();
    rows.begin_step();
    rows.add(column.contacts, motion);
    const auto manner = bullet::ContactSolver::Manner::full;
    rows.solve_impulses(motion, 10000, manner);
    std::vector<std::vector<bullet::Vector3d>> before, solved;  // by turn: without, with contacts
    for (int turn = 0; turn < 4; ++turn) {
      for (int i = 1; i < points; ++i) move_by_links(i, i % 3 == turn % 3 ? -0.004 : 0.001);
      before.push_back(motion.solved);
      if (anew) {
        rows.solve_impulses(motion, 10000, manner);
      } else {
        rows.solve_impulses_again(motion, 10000);
      }
      solved.push_back(motion.solved);
    }
    return std::pair(before, solved);
  };
  const auto [before, solved] = solve_in_turns(false);
  const auto [before_anew, anew] = solve_in_turns(true);
  const auto largest_difference = [](const auto& a, const auto& b) {
    double largest = 0;
    for (std::size_t v = 0; v < a.size(); ++v) largest = std::max(largest, (a[v] - b[v]).norm());
    return largest;
  };
  for (std::size_t turn = 0; turn < solved.size(); ++turn) {
    CAPTURE(turn);
    CHECK(largest_difference(before[turn], solved[turn]) > 1e-3);
    CHECK(largest_difference(before[turn], before_anew[turn]) < 3e-5);
    CHECK(largest_difference(solved[turn], anew[turn]) < 3e-5);
  }
}
