#include <algorithm>

#include "contact_rows.h"
#include "support/catch.h"

using namespace lazyccd;

TEST_CASE("a load that rests is solved to rest, however hard it presses") {
  // Points above each other, of which the lowest one is pinned; faces only carry them.
  constexpr int points = 30;
  bullet::Motion motion;
  motion.seconds = 0.01;
  std::vector<Contact> contacts;
  for (std::int32_t i = 0; i < points; ++i) {
    for (int k = 0; k < 3; ++k) {
      motion.start.insert(motion.start.end(), {btScalar(k), btScalar(0.1) * i, 0});
      motion.inverse_mass.push_back(i == 0 ? 0 : 1);
      motion.reach.push_back(1);
    }
    Contact contact = {};
    contact.kind = ContactKind::vertex_face;
    contact.primitive_a = i;
    contact.vertices = {3 * i + 3, 3 * i, 3 * i + 1, 3 * i + 2};
    contact.normal = {0, 1, 0};
    if (i + 1 < points) contacts.push_back(contact);
  }
  motion.first_vertex = {0, 3 * points};
  motion.rigid_of_body = {-1};
  bullet::ContactRows rows(
      [](std::int32_t, std::int32_t) {
        return bullet::PairSurface{0.1, 0};
      },
      0.05);
  const auto fall = [&](double metres, int sweeps) {
    motion.end = motion.start;
    for (std::size_t i = 1; i < points; ++i) motion.end[9 * i + 1] -= static_cast<btScalar>(metres);
    motion.begin_response();
    rows.begin_step();
    rows.add(contacts, false, motion);
    rows.start_warm();
    rows.relax(motion, sweeps);
  };
  fall(0.0100, 10000);
  // Faster by 1 cm/s: what is left of it is less than 1 mm/s.
  fall(0.0101, 30);
  double fastest = 0;
  for (std::int32_t i = 1; i < points; ++i)
    fastest = std::max(fastest, (motion.solved[3 * i] - motion.start_of(3 * i)).norm() / 0.01);
  CHECK(fastest < 1e-3);
}
