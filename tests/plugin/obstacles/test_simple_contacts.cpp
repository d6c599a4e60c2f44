// Several obstacles of simple shapes: which are met, and which are given up.
#include "obstacles/simple_contacts.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "plugin/support/draped_sheet.h"
#include "shapes/tessellation.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr double simple_margin = 0.01;  // m
constexpr btScalar big_radius = btScalar(0.5);

constexpr double sheet_height = 0.53;  // m, of the middle of the sheet

// A sheet of 169 nodes over a ball.
std::unique_ptr<DrapedSheet> drape_over_ball() {
  return std::make_unique<DrapedSheet>(
      std::make_unique<btSphereShape>(big_radius),
      [](double x, double z, double) {
        return std::sqrt(sheet_height * sheet_height - x * x - z * z);
      },
      1);
}

// A compound of a ball and a box, which it owns.
struct BallAndBox : btCompoundShape {
  btSphereShape ball;
  btBoxShape box{btVector3(btScalar(0.02), btScalar(0.02), btScalar(0.02))};
  explicit BallAndBox(btScalar ball_radius) : ball(ball_radius) {
    btTransform place;
    place.setIdentity();
    addChildShape(place, &box);
    place.setOrigin(btVector3(btScalar(0.1), 0, 0));
    addChildShape(place, &ball);
  }
};

std::vector<Body> filters_of(const DrapedContacts& drape) {
  std::vector<Body> filters(drape.topology.bodies().size());
  drape.contacts.leave_out(filters);
  return filters;
}

int count_of(const std::vector<Contact>& contacts, std::int32_t body) {
  return static_cast<int>(std::count_if(contacts.begin(), contacts.end(), [body](const Contact& c) {
    return c.body_a == body || c.body_b == body;
  }));
}

}  // namespace

TEST_CASE("an obstacle that a node starts in is given up, and no other") {
  const bool is_compound = GENERATE(false, true);
  CAPTURE(is_compound);
  const auto draped = drape_over_ball();
  // Around the middle of the sheet.
  const btVector3 place(0, static_cast<btScalar>(sheet_height), 0);
  if (is_compound)
    draped->add_obstacle(std::make_unique<BallAndBox>(btScalar(0.03)), place);
  else
    draped->add_obstacle(
        std::make_unique<btBoxShape>(btVector3(big_radius, big_radius, big_radius) / 10), place);
  draped->read();
  DrapedContacts drape(*draped);
  REQUIRE(drape.topology.bodies().size() == 3);
  std::vector<Contact> found;
  for (int round = 0; round < 2; ++round) {  // a new topology begins anew
    drape.contacts.set_topology({});
    CHECK(filters_of(drape)[1].layer == 0);
    CHECK(filters_of(drape)[2].layer == 0);
    CHECK(!drape.contacts.find_near(simple_margin + 0.05, found));
    CHECK(drape.contacts.any());
    CHECK(filters_of(drape)[1].layer == 0);
    CHECK(filters_of(drape)[2].layer != 0);
    CHECK(count_of(found, 1) > 10);
    CHECK(count_of(found, 2) == 0);
    CHECK(drape.contacts.find_near(simple_margin + 0.05, found));
    CHECK(count_of(found, 2) == 0);
  }
  drape.contacts.clear();
  CHECK(!drape.contacts.any());
  CHECK(drape.contacts.find_near(simple_margin, found));
  CHECK(found.empty());
  CHECK(drape.contacts.are_clear(false));
}

TEST_CASE("obstacles with too many parts are left to the detector, and no others") {
  // 169 nodes and 250 parts are too many pairs.
  struct ManyBoxes : btCompoundShape {
    btBoxShape box{btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1))};
    ManyBoxes() {
      for (int i = 0; i < 250; ++i)
        addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(btScalar(i) / 1000, 0, 0)),
                      &box);
    }
  };
  const auto draped = drape_over_ball();
  draped->add_obstacle(std::make_unique<ManyBoxes>(), btVector3(0, big_radius - btScalar(0.15), 0));
  draped->add_obstacle(std::make_unique<BallAndBox>(btScalar(0.03)),
                       btVector3(0, big_radius - btScalar(0.05), 0));
  draped->read();
  const DrapedContacts drape(*draped);
  const std::vector<Body> filters = filters_of(drape);
  REQUIRE(filters.size() == 4);
  CHECK(filters[1].layer == 0);
  CHECK(filters[2].layer != 0);
  CHECK(filters[3].layer == 0);
}

TEST_CASE("a ball without size is no part of a compound") {
  BallAndBox shape(0);
  bullet::Triangles triangles;
  CHECK(!bullet::tessellate(shape, btTransform::getIdentity(), bullet::AxisBox::empty(),
                            bullet::AxisBox::empty(), simple_margin, triangles));
  CHECK(triangles.round_parts.empty());
  CHECK(triangles.convex_parts.size() == 1);
}
