// Near pairs that bind the same points are answered once.
#include "distinct_contacts.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;

namespace {

Contact pair(ContactKind kind, std::array<std::int32_t, 4> vertices, float u, float v) {
  Contact contact{};
  contact.kind = kind;
  contact.vertices = vertices;
  contact.u = u;
  contact.v = v;
  return contact;
}

}  // namespace

TEST_CASE("of pairs that bind the same points the first is kept") {
  constexpr ContactKind vf = ContactKind::vertex_face, ee = ContactKind::edge_edge;
  const Contact corner = pair(vf, {7, 1, 2, 3}, 0, 0);          // 7 above 1
  const Contact other_face = pair(vf, {7, 4, 1, 3}, 1, 0);      // the same, of another face
  const Contact ends = pair(ee, {1, 2, 8, 7}, 0, 1);            // the same, of two edges, turned
  const Contact inside = pair(vf, {7, 1, 2, 3}, 0.25f, 0.25f);  // another point of the face
  const Contact edges = pair(ee, {1, 2, 8, 7}, 0.5f, 1);        // 7 above the middle of an edge
  Contact later = corner;
  later.toi = 0.5;

  std::vector<Contact> all = {corner, other_face, ends, inside, edges, later};
  keep_distinct(all, {1, 1, 1, 1, 1, 1});
  REQUIRE(all.size() == 4);
  CHECK(all[0].vertices == corner.vertices);
  CHECK(all[1].u == inside.u);
  CHECK(all[2].kind == ee);
  CHECK(all[3].toi == later.toi);

  std::vector<Contact> thicknesses = {corner, other_face};
  keep_distinct(thicknesses, {1, 0.5});
  CHECK(thicknesses.size() == 2);
  std::vector<Contact> none;
  keep_distinct(none, {});
  CHECK(none.empty());
}
