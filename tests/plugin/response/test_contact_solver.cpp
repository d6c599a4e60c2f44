#include <algorithm>
#include <vector>

#include "plugin/support/column.h"
#include "plugin/support/contacts.h"
#include "response/contact_constraints.h"
#include "support/catch.h"

using namespace lazyccd;
using lazyccd::test::Column;

TEST_CASE("a resting load is solved to rest at any force") {
  constexpr int points = 30;
  Column column(std::vector<double>(points - 1, 1));
  bullet::Motion& motion = column.motion;
  const bullet::PairSurfaces surfaces = lazyccd::test::uniform_surfaces(0.1, 0);
  bullet::ContactConstraints rows(surfaces, 0.05);
  const auto fall = [&](double metres, int sweeps) {
    motion.end = motion.start;
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
