// ContactRenumbering: contacts of bodies that did not change, when others come or go.
#include "contact/contact_renumbering.h"

#include "support/catch.h"

using namespace lazyccd;
using bullet::ContactRenumbering;
using bullet::PrimitiveIndices;
using bullet::Renumbering;

namespace {

// A body with three vertices, one face, three edges and one edge of its own, the n-th of its kind.
PrimitiveIndices::OfBody nth(std::int32_t n) {
  return {{3 * n, 3 * n + 3}, {n, n + 1}, {n, n + 1}, {4 * n, 4 * n + 4}};
}

PrimitiveIndices bodies(std::int32_t count) {
  std::vector<PrimitiveIndices::OfBody> all;
  for (std::int32_t n = 0; n < count; ++n) all.push_back(nth(n));
  return PrimitiveIndices(all, 4 * count, 7 * count);
}

// Body 0 of three is gone.
const Renumbering without_first{{-1, 0, 1}, {-1, -1, -1, 0, 1, 2, 3, 4, 5}};

Contact between(std::int32_t a, std::int32_t b, ContactKind kind) {
  Contact contact = {};
  contact.kind = kind;
  contact.body_a = a;
  contact.body_b = b;
  return contact;
}

}  // namespace

TEST_CASE("a contact keeps its primitives when another body goes") {
  const PrimitiveIndices before = bodies(3), after = bodies(2);
  const ContactRenumbering numbers(before, after, without_first, {0, 0});
  Contact vertex = between(1, 2, ContactKind::vertex_face);
  vertex.primitive_a = 4;
  vertex.primitive_b = 2;
  vertex.vertices = {4, 6, 7, 8};
  REQUIRE(numbers.renumber(vertex));
  CHECK(vertex.body_a == 0);
  CHECK(vertex.body_b == 1);
  CHECK(vertex.primitive_a == 1);
  CHECK(vertex.primitive_b == 1);
  CHECK(vertex.vertices == std::array<std::int32_t, 4>{1, 3, 4, 5});

  Contact edges = between(1, 2, ContactKind::edge_edge);
  SECTION("an edge of the detector and a side of a face") {
    edges.primitive_a = 4 + 2;
    edges.primitive_b = 12 + 3 * 2 + 1;
    REQUIRE(numbers.renumber(edges));
    CHECK(edges.primitive_a == 2);
    CHECK(edges.primitive_b == 8 + 3 * 1 + 1);
  }
  SECTION("edges that the topology has of its own") {
    edges.primitive_a = 21 + 1;
    edges.primitive_b = 21 + 2;
    REQUIRE(numbers.renumber(edges));
    CHECK(edges.primitive_a == 14);
    CHECK(edges.primitive_b == 15);
  }
}

TEST_CASE("nothing is kept of a body that is gone or changed, or if the order is another one") {
  const PrimitiveIndices before = bodies(3), after = bodies(2), three = bodies(3);
  Contact contact = between(0, 2, ContactKind::vertex_face);
  CHECK_FALSE(ContactRenumbering(before, after, without_first, {0, 0}).renumber(contact));
  contact = between(1, 2, ContactKind::vertex_face);
  CHECK_FALSE(ContactRenumbering(before, after, without_first, {0, 1}).renumber(contact));
  const Renumbering turned{{2, 1, 0}, {6, 7, 8, 3, 4, 5, 0, 1, 2}};
  CHECK_FALSE(ContactRenumbering(before, three, turned, {0, 0, 0}).renumber(contact));
  const Renumbering other_vertices{{-1, 0, 1}, {-1, -1, -1, 0, 2, 1, 3, 4, 5}};
  CHECK_FALSE(ContactRenumbering(before, after, other_vertices, {0, 0}).renumber(contact));
}
