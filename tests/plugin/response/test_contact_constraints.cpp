#include "contact/contact_row.h"
#include "plugin/support/contacts.h"
#include "support/catch.h"

using namespace lazyccd;
using lazyccd::test::contact;

TEST_CASE("within a body the thickness is one of points, whichever pair stands for them") {
  constexpr ContactKind vf = ContactKind::vertex_face, ee = ContactKind::edge_edge;
  bullet::Motion motion;
  motion.shortest_edge = {0.04, 0.1, 0.01, 0.2, 0.004, 0.06};
  const auto thickness = [&motion](const Contact& c) {
    return bullet::thickness_of(c, motion, 0.025);
  };
  // Vertex 0 above vertex 1, of two faces and of edges.
  const double corner = 0.5 * motion.shortest_edge[0];
  CHECK(thickness(contact(vf, {0, 1, 2, 3}, 0, 0)) == corner);
  CHECK(thickness(contact(vf, {0, 4, 5, 1}, 0, 1)) == corner);
  CHECK(thickness(contact(ee, {0, 2, 4, 1}, 0, 1)) == corner);
  // Above the middle of the edge that they share.
  const double middle = thickness(contact(vf, {3, 5, 2, 4}, 0.5f, 0));
  CHECK_THAT(middle, Matchers::WithinAbs(0.5 * 0.5 * (motion.shortest_edge[5] + motion.shortest_edge[2]), 1e-12));
  CHECK(thickness(contact(vf, {3, 1, 5, 2}, 0.5f, 0.5f)) == middle);
  CHECK(thickness(contact(ee, {5, 2, 4, 3}, 0.5f, 1)) == middle);
  // Hardly beside it, hardly another.
  CHECK_THAT(thickness(contact(vf, {3, 5, 2, 4}, 0.5f, 1e-4f)), Matchers::WithinAbs(middle, 1e-5));
  // Where edges are long, that of the surfaces; of two bodies, always.
  CHECK(thickness(contact(vf, {3, 1, 2, 4}, 0, 0)) == 0.025);
  Contact of_two = contact(vf, {4, 2, 2, 2}, 0, 0);
  of_two.body_b = 1;
  CHECK(thickness(of_two) == 0.025);
}
