#include "contact/contact_row.h"
#include "plugin/support/contacts.h"
#include "support/catch.h"

using namespace lazyccd;
using lazyccd::test::contact;

TEST_CASE("within a body the thickness depends on the points and not on the pair") {
  constexpr ContactKind vf = ContactKind::vertex_face, ee = ContactKind::edge_edge;
  bullet::Motion motion;
  motion.input().shortest_edge = {0.04, 0.1, 0.01, 0.2, 0.004, 0.06};
  const auto thickness = [&motion](const Contact& c) {
    return bullet::thickness_of(c, motion, 0.025);
  };
  // Vertex 0 above vertex 1, as a pair with one of two faces and as a pair of edges.
  const double corner = 0.5 * motion.shortest_edge()[0];
  CHECK(thickness(contact(vf, {0, 1, 2, 3}, 0, 0)) == corner);
  CHECK(thickness(contact(vf, {0, 4, 5, 1}, 0, 1)) == corner);
  CHECK(thickness(contact(ee, {0, 2, 4, 1}, 0, 1)) == corner);
  // Above the midpoint of the edge that the faces share.
  const double middle = thickness(contact(vf, {3, 5, 2, 4}, 0.5f, 0));
  CHECK_THAT(middle,
             Matchers::WithinAbs(
                 0.5 * 0.5 * (motion.shortest_edge()[5] + motion.shortest_edge()[2]), 1e-12));
  CHECK(thickness(contact(vf, {3, 1, 5, 2}, 0.5f, 0.5f)) == middle);
  CHECK(thickness(contact(ee, {5, 2, 4, 3}, 0.5f, 1)) == middle);
  // A point close to the midpoint has a similar thickness.
  CHECK_THAT(thickness(contact(vf, {3, 5, 2, 4}, 0.5f, 1e-4f)), Matchers::WithinAbs(middle, 1e-5));
  // The thickness of the surfaces: if edges are long, and always between two bodies.
  CHECK(thickness(contact(vf, {3, 1, 2, 4}, 0, 0)) == 0.025);
  Contact of_two = contact(vf, {4, 2, 2, 2}, 0, 0);
  of_two.body_b = 1;
  CHECK(thickness(of_two) == 0.025);
}
