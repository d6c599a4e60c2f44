// Rows of what is near are made when they are asked for, in the order of their contacts.
#include "contact/row_list.h"

#include <utility>
#include <vector>

#include "detection/speculative_contacts.h"
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

}  // namespace

TEST_CASE("a list makes the rows that it is asked for, once, and they stay") {
  const std::vector<Contact> contacts = contacts_of({2, 3, 5, 8});
  std::vector<Prospect> prospects(4);
  for (std::size_t i = 0; i < 4; ++i) prospects[i].gives_way = i != 2;
  int made = 0;
  RowList list;
  list.take(NearProspects{contacts, prospects}, [&](const Contact& contact, ContactRow& row) {
    ++made;
    row.contact = contact;
    row.gives_way = true;
  });
  REQUIRE(list.size() == 4);
  CHECK_FALSE(list.is_made(3));
  CHECK(list.contact(3).primitive_a == 8);
  CHECK(list.gives_way(3));
  ContactRow& last = list[3];
  CHECK(last.contact.primitive_a == 8);
  last.impulse = 7;
  CHECK(list[0].contact.primitive_a == 2);
  // What stands for nothing gives no way, whatever its contact says.
  CHECK_FALSE(list.gives_way(2));
  CHECK_FALSE(list[2].gives_way);
  CHECK(&list[3] == &last);
  CHECK(list[3].impulse == 7);
  CHECK(made == 3);
  CHECK_FALSE(list.is_made(1));

  std::vector<ContactRow> others(2);
  others[0].contact = contacts[1];
  others[1].contact = contacts[2];
  list.take(others);
  REQUIRE(list.size() == 2);
  CHECK(list.is_made(1));
  CHECK(list[1].contact.primitive_a == 5);
  list.clear();
  CHECK(list.size() == 0);
}

TEST_CASE("keys of contacts are in the order of contacts") {
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
      REQUIRE((a < b) == (NearContacts::key_of(a) < NearContacts::key_of(b)));
  }
}

TEST_CASE("a contact is found in a list from wherever it is sought") {
  const std::vector<Contact> contacts = contacts_of({2, 3, 5, 5, 8, 9, 12, 20, 21});
  std::vector<Prospect> prospects(contacts.size());
  RowList list;
  list.take(NearProspects{contacts, prospects}, [](const Contact&, ContactRow&) {});
  for (std::int32_t sought = 0; sought < 23; ++sought) {
    const Contact contact = contacts_of({sought})[0];
    std::size_t expected = 0;
    while (expected < contacts.size() && contacts[expected] < contact) ++expected;
    for (std::size_t first = 0; first <= expected; ++first)
      CHECK(list.find(contact, first) == expected);
  }
}
