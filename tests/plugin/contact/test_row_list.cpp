// RowList: makes the rows of near pairs on demand, in the order of their contacts.
#include "contact/row_list.h"

#include <utility>
#include <vector>

#include "detection/near_contact_selector.h"
#include "plugin/support/contacts.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;

namespace {

std::vector<Contact> contacts_of(const std::vector<std::int32_t>& primitives) {
  std::vector<Contact> contacts;
  for (const std::int32_t primitive : primitives) {
    contacts.push_back(lazyccd::test::contact(ContactKind::vertex_face, {0, 1, 2, 3}, 0, 0));
    contacts.back().primitive_a = primitive;
  }
  return contacts;
}

// A vertex above a face; impulses can move all four vertices.
struct Rows {
  PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0);
  Motion motion;
  RowFactory factory{surfaces, 0.05, motion};

  Rows() {
    motion.input().start = motion.end = {0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    motion.input().inverse_mass = motion.input().shortest_edge = {1, 1, 1, 1};
    motion.input().first_vertex = {0, 4};
    motion.input().rigid_of_body = {-1};
  }
};

}  // namespace

TEST_CASE("a list makes each row on first access and keeps it") {
  const std::vector<Contact> contacts = contacts_of({2, 3, 5, 8});
  std::vector<RowEstimate> estimates(4);
  for (std::size_t i = 0; i < 4; ++i) estimates[i].can_act = i != 2;
  const Rows rows;
  RowList list;
  list.take(NearContacts{contacts, estimates}, rows.factory);
  REQUIRE(list.size() == 4);
  CHECK_FALSE(list.is_made(3));
  CHECK(list.contact(3).primitive_a == 8);
  CHECK(list.can_act(3));
  ContactRow& last = list[3];
  CHECK(last.contact.primitive_a == 8);
  last.normal_impulse = 7;
  CHECK(list[0].contact.primitive_a == 2);
  // A deselected contact gives a row that cannot act, although impulses could move its vertices.
  CHECK_FALSE(list.can_act(2));
  CHECK_FALSE(list[2].can_act);
  CHECK(&list[3] == &last);
  CHECK(list[3].normal_impulse == 7);
  CHECK(list.is_made(0));
  CHECK(list.is_made(2));
  CHECK_FALSE(list.is_made(1));

  list.clear();
  CHECK(list.size() == 0);
}

TEST_CASE("rows are added in order, and others are not made for them") {
  const std::vector<Contact> contacts = contacts_of({2, 3, 5, 8, 9});
  std::vector<RowEstimate> estimates(5);
  for (std::size_t i = 0; i < 5; ++i) estimates[i].can_act = i != 3;
  const Rows rows;
  RowList list;
  list.take(NearContacts{contacts, estimates}, rows.factory);
  list[1].normal_impulse = 7;
  list[2].normal_impulse = 0;
  const auto make = [&](const Contact& contact, ContactRow& row) {
    rows.factory.make(contact, row);
    row.normal_impulse = 1;
  };
  list.add(contacts_of({1, 3, 5, 9}), make);
  // 8 cannot act; 5 had no impulse; 9 was not made.
  std::vector<std::int32_t> primitives;
  std::vector<double> impulses;
  for (std::size_t i = 0; i < list.size(); ++i) {
    primitives.push_back(list.contact(i).primitive_a);
    impulses.push_back(list.is_made(i) ? list.made(i).normal_impulse : -1);
  }
  CHECK(primitives == std::vector<std::int32_t>{1, 2, 3, 3, 5, 9});
  CHECK(impulses == std::vector<double>{1, -1, 7, 1, 1, 1});
}

TEST_CASE("contacts and their keys have the same order") {
  std::vector<Contact> contacts;
  for (int i = 0; i < 243; ++i) {
    Contact contact = {};
    int rest = i;
    const auto next = [&rest] { return std::exchange(rest, rest / 3) % 3 * 40000; };
    contact.body_a = next();
    contact.body_b = next();
    contact.primitive_a = next();
    contact.primitive_b = next();
    contact.kind = next() == 0 ? ContactKind::vertex_face : ContactKind::edge_edge;
    contacts.push_back(contact);
  }
  for (const Contact& a : contacts) {
    for (const Contact& b : contacts)
      REQUIRE((a < b) ==
              (NearContactSelector::pair_key_of(a) < NearContactSelector::pair_key_of(b)));
  }
}

TEST_CASE("a contact is found in a list from any start of the search") {
  const std::vector<Contact> contacts = contacts_of({2, 3, 5, 5, 8, 9, 12, 20, 21});
  std::vector<RowEstimate> estimates(contacts.size());
  RowList list;
  const Rows rows;
  list.take(NearContacts{contacts, estimates}, rows.factory);
  for (std::int32_t wanted = 0; wanted < 23; ++wanted) {
    const Contact contact = contacts_of({wanted})[0];
    std::size_t expected = 0;
    while (expected < contacts.size() && contacts[expected] < contact) ++expected;
    for (std::size_t first = 0; first <= expected; ++first)
      CHECK(list.find(contact, first) == expected);
  }
}
