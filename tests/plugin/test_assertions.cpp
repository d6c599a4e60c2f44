// Assertions of the adapter that an input can make fail. tests/assertions/README.md lists all
// assertions.
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "assertions/failed_belief.h"
#include "contact/contact_cache.h"
#include "contact/last_impulses.h"
#include "contact/row_list.h"
#include "links/link_batches.h"
#include "plugin/support/contacts.h"
#include "report/step_contacts.h"
#include "response/contact_constraints.h"
#include "response/response.h"
#include "solver/row_batches.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;
using lazyccd::test::failed_belief;

namespace {

// A vertex above a face, and a second one above the same face. All may move.
struct VerticesAboveFace {
  PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0.5, 2);
  Motion motion;

  VerticesAboveFace() {
    motion.input().start = {0, 1, 0, 0, 2, 0, -1, 0, -1, 2, 0, -1, -1, 0, 2};
    motion.end = motion.start();
    motion.input().inverse_mass = std::vector<double>(5, 1);
    motion.input().shortest_edge = motion.input().rate = std::vector<double>(5, 1);
    motion.input().velocity.assign(5, bullet::Vector3d::Zero());
    motion.velocity_change = motion.velocity();
    motion.input().first_vertex = {0, 2, 5};
    motion.input().rigid_of_body = {-1, -1};
    motion.begin_response();
  }
  static Contact contact(std::int32_t vertex = 0) {
    Contact made = lazyccd::test::contact(ContactKind::vertex_face, {vertex, 2, 3, 4}, 0.3F, 0.3F);
    made.body_b = 1;
    made.primitive_a = vertex;
    return made;
  }
  ContactRow row(const Contact& contact) const {
    ContactRow made;
    RowFactory(surfaces, 0.05, motion).make(contact, made);
    return made;
  }
  std::string belief_of_row(const Contact& contact) const {
    return failed_belief([&] { row(contact); });
  }
};

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("assertions on the row of a contact fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  VerticesAboveFace scene;
  const Contact contact = VerticesAboveFace::contact();
  CHECK(scene.belief_of_row(contact).empty());
  SECTION("weights") {
    Contact wrong = contact;
    wrong.u = static_cast<float>(not_a_number);
    CHECK(scene.belief_of_row(wrong) == "the weights of a row sum to zero");
  }
  SECTION("normal") {
    Contact wrong = contact;
    wrong.normal = {0, 2, 0};
    CHECK(scene.belief_of_row(wrong) == "the normal of a row has length 1");
  }
  SECTION("start") {
    scene.motion.input().start[1] = static_cast<btScalar>(not_a_number);
    CHECK(scene.belief_of_row(contact) == "a row begins with a finite gap");
  }
  SECTION("mass") {
    scene.motion.input().inverse_mass.assign(5, 1e-310);
    CHECK(scene.belief_of_row(contact) == "the effective mass of a row is finite and not negative");
  }
  SECTION("friction") {
    PairSurfaces negative = lazyccd::test::uniform_surfaces(0.1, 0, 2);
    negative.update(std::vector<BodySurface>{{0, -1, true}, {0, -2, true}});
    ContactRow row;
    CHECK(failed_belief([&] { RowFactory(negative, 0.05, scene.motion).make(contact, row); }) ==
          "friction opposes the sliding");
  }
  SECTION("pair") {
    Contact wrong = contact;
    wrong.body_b = 2;
    CHECK(scene.belief_of_row(wrong) == "a pair is of bodies of the step");
  }
  SECTION("limits") {
    scene.surfaces.limit_thickness(std::vector<double>{0.1});
    CHECK(scene.belief_of_row(contact) == "each body of the step has its limit");
  }
}

TEST_CASE("assertions on surfaces fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  CHECK(failed_belief([] {
          lazyccd::test::uniform_surfaces(0.1, 0).update(
              std::vector<BodySurface>{{not_a_number, 0, true}});
        }) == "margins are finite and not negative");
  CHECK(failed_belief([] {
          lazyccd::test::uniform_surfaces(0.1, 0).set_moved_apart(
              std::vector<BodyPair>{{1, 2}, {0, 1}});
        }) == "pairs to be parted are sorted");
}

TEST_CASE("assertions on lists of rows fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  const VerticesAboveFace scene;
  const RowFactory factory(scene.surfaces, 0.05, scene.motion);
  const Contact low = VerticesAboveFace::contact(0), high = VerticesAboveFace::contact(1);
  const std::vector<Contact> sorted = {low, high}, unsorted = {high, low};
  std::vector<RowEstimate> estimates(2);
  RowList list;
  const auto belief = [&](const std::vector<Contact>& contacts, std::size_t count) {
    return failed_belief([&] {
      list.take(NearContacts{contacts, {estimates.data(), count}}, factory);
    });
  };
  CHECK(belief(sorted, 2).empty());
  CHECK(belief(sorted, 1) == "each near contact has an estimate");
  CHECK(belief(unsorted, 2) == "near contacts of a list are in order");
  CHECK(failed_belief([&] {
          RowList({scene.row(high), scene.row(low)});
        }) == "rows of a list are in the order of their contacts");
  list.take(NearContacts{sorted, estimates}, factory);
  CHECK(failed_belief([&] { list.made(0); }) == "a row that is read as made is made");
  CHECK(failed_belief([&] {
          list.place(0);
          list.place(0);
        }) == "a row gets one place");
  Contact inside = low;
  inside.normal = {0, -1, 0};
  const std::vector<Contact> wrong_side = {inside};
  list.take(NearContacts{wrong_side, {estimates.data(), 1}}, factory);
  CHECK(failed_belief([&] { list[0]; }) ==
        "the start of the step satisfies the row of what is near then");
}

TEST_CASE("assertions on added rows fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  const VerticesAboveFace scene;
  const Contact low = VerticesAboveFace::contact(0), high = VerticesAboveFace::contact(1);
  Contact turned = low;
  turned.normal = {0, -1, 0};
  ContactConstraints constraints(scene.surfaces, 0.05);
  const auto belief = [&](const std::vector<Contact>& contacts) {
    return failed_belief([&] { constraints.add(contacts, scene.motion); });
  };
  CHECK(belief({low, high}).empty());
  CHECK(belief({high, low}) == "contacts that become rows are sorted, none twice");
  CHECK(failed_belief([&] {
          constraints.add_penetrations({high, low}, 1, scene.motion);
        }) == "contacts that become rows are in order");
  CHECK(belief({turned}) == "the start of the step satisfies an added row");
  VerticesAboveFace touching;
  touching.motion.input().start[1] = touching.motion.end[1] = 0;
  touching.motion.begin_response();
  constraints.add({low}, touching.motion);
  constraints.rows()[0].normal_impulse = 1;
  const auto belief_at_gap_zero = [&](const Contact& contact) {
    return failed_belief([&] { constraints.add({contact}, touching.motion); });
  };
  CHECK(belief_at_gap_zero(low).empty());
  CHECK(belief_at_gap_zero(turned) ==
        "rows of a pair that is in contact at the start have one sign");
}

TEST_CASE("assertions on kept impulses fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  const VerticesAboveFace scene;
  ContactRow low = scene.row(VerticesAboveFace::contact(0)),
             high = scene.row(VerticesAboveFace::contact(1));
  low.normal_impulse = high.normal_impulse = 1;
  LastImpulses last;
  CHECK(failed_belief([&] {
          last.take({&high, &low});
        }) == "rows whose impulses are kept are in order");
  CHECK(failed_belief([&] {
          last.match(std::vector<Contact>{high.contact, low.contact});
        }) == "contacts that impulses are matched with are sorted");
  last.take({&low, &high});
  CHECK(failed_belief([&] {
          last.renumber({{0, 1}, {0, 1, 2}});
        }) == "old indices of a contact are in range");
}

TEST_CASE("assertions on kept contacts fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  const VerticesAboveFace scene;
  const std::vector<double> distances = {1, 1}, one = {1}, three = {1, 1, 1};
  const Contact low = VerticesAboveFace::contact(0), high = VerticesAboveFace::contact(1);
  ContactCache cache;
  CHECK(failed_belief([&] { cache.begin(scene.motion, three); }) ==
        "distances within which pairs are found are of bodies of the motion");
  cache.begin(scene.motion, distances);
  CHECK(failed_belief([&] { cache.take({}, one); }) == "each body has a distance from others");
  CHECK(failed_belief([&] {
          cache.take({high, low}, distances);
        }) == "kept and found contacts are sorted, none twice");
  cache.take({low}, distances);
  REQUIRE(cache.begin(scene.motion, distances));
  CHECK(failed_belief([&] { cache.take({low}, distances); }) ==
        "a detection leaves out the pairs of bodies that stay in place");
}

TEST_CASE("assertions on renumbered contacts fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  const VerticesAboveFace scene;
  const std::vector<double> distances = {1, 1};
  const PrimitiveIndices::OfBody vertices{{0, 2}, {0, 0}, {0, 0}, {0, 0}},
      face{{2, 5}, {0, 1}, {0, 0}, {0, 9}};
  const Renumbering same{{0, 1}, {0, 1, 2, 3, 4}};
  const PrimitiveIndices before({vertices, face}, 5, 20), after({vertices, face}, 0, 20);
  CHECK(failed_belief([&] { const ContactRenumbering renumbering(before, after, same, {0}); }) ==
        "each body has changed or not");
  Contact first = VerticesAboveFace::contact(0), second = first;
  first.kind = second.kind = ContactKind::edge_edge;
  first.primitive_b = 4;
  second.primitive_b = 5;  // a side of a face, which is first there
  ContactCache cache;
  cache.begin(scene.motion, distances);
  cache.take({first, second}, distances);
  const ContactRenumbering renumbering(before, after, same, {0, 0});
  CHECK(failed_belief([&] { cache.renumber(renumbering, scene.motion.start().size()); }) ==
        "renumbering keeps the order of contacts");
}

TEST_CASE("assertions on what the response is given fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  VerticesAboveFace scene;
  SolverOptions options;
  Response response(options, scene.surfaces);
  response.begin_step(1);
  StepStats stats;
  const Contact low = VerticesAboveFace::contact(0), high = VerticesAboveFace::contact(1);
  std::vector<Contact> at_start, at_end;
  const auto belief = [&] {
    const auto detect = [&](const Positions&, const Positions& end) {
      return end.data() == scene.motion.start().data() ? at_start : at_end;
    };
    return failed_belief([&] { response.run({}, {}, detect, {}, scene.motion, stats); });
  };
  CHECK(belief().empty());
  SECTION("vertices of another body") {
    at_end = {low};
    at_end[0].vertices[1] = 1;
    CHECK(belief() == "contacts are of bodies and vertices of the motion");
  }
  SECTION("no such body") {
    at_end = {low};
    at_end[0].body_b = 2;
    CHECK(belief() == "contacts are of bodies and vertices of the motion");
  }
  SECTION("order at the start") {
    at_end = {low, high};
    at_start = {high, low};
    CHECK(belief() == "contacts at the start are sorted, none twice");
  }
  SECTION("no time passes") {
    scene.motion.input().dt = 0;
    scene.motion.input().rate.assign(5, std::numeric_limits<double>::infinity());
    CHECK(belief() == "the response changes velocities by finite amounts");
  }
}

TEST_CASE("assertions on a motion fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  VerticesAboveFace scene;
  CHECK(failed_belief([&] {
          scene.motion.input().anchor(5, {btVector3(0, 0, 0), 0});
        }) == "a node that is anchored is soft");
  CHECK(failed_belief([&] {
          scene.motion.input().anchor(0, {btVector3(0, 0, 0), 0});
        }) == "a node is anchored to a rigid body of the motion");
  scene.motion.end.pop_back();
  CHECK(failed_belief([&] { scene.motion.begin_response(); }) ==
        "each vertex has a start and an end");
}

TEST_CASE("assertions of the contact solver fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  const VerticesAboveFace scene;
  RowList rows({scene.row(VerticesAboveFace::contact())}), none;
  RowIslands islands;
  islands.find(rows, scene.motion, Threads(1));
  ContactSolver solver(ContactSolver::Target::motion, Threads(1));
  CHECK(failed_belief([&] { solver.set_up(none, islands, scene.motion); }) ==
        "islands are of the rows to solve");
  Motion before = scene.motion;
  before.solved.clear();
  CHECK(failed_belief([&] { solver.set_up(rows, islands, before); }) ==
        "the response to the motion has begun");
  CHECK(failed_belief([] { ContactSolver(ContactSolver::Target::motion, Threads(1)).go_on(); }) ==
        "a problem that goes on was set up");
  RowBatches batches;
  batches.begin(16);
  const std::vector<std::int32_t> slots = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  CHECK(failed_belief([&] { batches.add(0, slots.data(), slots.data() + 9); }) ==
        "a row moves at most max_slots slots");
}

TEST_CASE("assertions on reports and links fail where they must") {
  if (!lazyccd::test::finds_failed_beliefs) return;
  const VerticesAboveFace scene;
  const ContactRow low = scene.row(VerticesAboveFace::contact(0)),
                   high = scene.row(VerticesAboveFace::contact(1));
  const SoftScene soft{CollisionFlags(true)};
  const StepTopology topology;
  std::vector<StepContact> contacts;
  const auto belief = [&](const std::vector<const ContactRow*>& rows, Contact report_only) {
    return failed_belief([&] {
      make_step_contacts(rows, {report_only}, soft, topology, scene.motion, Threads(1), contacts);
    });
  };
  CHECK(belief({&high, &low}, low.contact) == "rows to report are in the order of their contacts");
  Contact wrong = low.contact;
  wrong.vertices[0] = 5;
  CHECK(belief({&low, &high}, wrong) == "contacts to report are of the motion");

  CHECK(failed_belief([] { plan_links({{0, 3}}, 3, 4); }) == "links end at nodes of the body");
  const LinkEnds ends = {{0, 1}, {1, 2}};
  CHECK(failed_belief([&] { make_groups<float>(plan_links({ends[0]}, 3, 4), ends); }) ==
        "each link has a place in the plan");
}
