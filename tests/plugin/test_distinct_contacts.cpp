// Near pairs that bind the same points are answered once.
#include "distinct_contacts.h"
#include "plugin/contacts.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;
using lazyccd::test::contact;

namespace {

void keep(std::vector<Contact>& contacts, const std::vector<double>& gaps) {
  std::vector<Binding> bindings;
  for (const Contact& contact : contacts) bindings.push_back(binding_of(contact));
  keep_distinct(contacts, bindings, gaps);
}

}  // namespace

TEST_CASE("of pairs that bind nearly the same points the nearest is kept") {
  constexpr ContactKind vf = ContactKind::vertex_face, ee = ContactKind::edge_edge;
  const Contact corner = contact(vf, {7, 1, 2, 3}, 0, 0);      // 7 above 1
  const Contact other_face = contact(vf, {7, 4, 1, 3}, 1, 0);  // the same, of another face
  Contact ends = contact(ee, {1, 2, 8, 7}, 0, 1);              // the same, of two edges, turned
  ends.normal = {0, -1, 0};
  const Contact inside = contact(vf, {7, 1, 2, 3}, 0.25f, 0.25f);  // another point of the face
  const Contact edges = contact(ee, {1, 2, 8, 7}, 0.5f, 1);        // 7 above the middle of an edge
  const Contact beside = contact(vf, {7, 1, 2, 3}, 0.01f, 0.01f);  // nearly above 1
  Contact aslant = corner;
  aslant.normal = {0.8f, 0.6f, 0};

  std::vector<Contact> all = {corner, other_face, ends, inside, edges, beside, aslant};
  std::vector<Contact> last = all;
  keep(all, {1, 1, 1, 1, 1, 1, 1});
  REQUIRE(all.size() == 4);
  CHECK(all[0].vertices == corner.vertices);
  CHECK(all[1].u == inside.u);
  CHECK(all[2].kind == ee);
  CHECK(all[3].normal == aslant.normal);

  keep(last, {1, 1, 1, 1, 1, 0.9, 1});
  REQUIRE(last.size() == 4);
  CHECK(last[0].u == inside.u);
  CHECK(last[2].u == beside.u);

  std::vector<Contact> none;
  keep(none, {});
  CHECK(none.empty());
}
