// Boxes and planes that are met at one side: against their triangles and the detector.
#include "detection/flat_contacts.h"

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "lazyccd/detector.h"
#include "plugin/support/draped_sheet.h"
#include "shapes/tessellation.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr btScalar half_side = btScalar(0.4);
constexpr double margin = 0.01;  // m
const btVector3 half_extents(half_side, half_side, half_side);

// A compound of a box that is turned by a right angle; it owns the box.
struct TurnedBox : btCompoundShape {
  btBoxShape box{half_extents};
  TurnedBox() { addChildShape(btTransform(btQuaternion(btVector3(1, 0, 0), SIMD_HALF_PI)), &box); }
};

std::unique_ptr<btCollisionShape> make_shape(const std::string& kind) {
  if (kind == "box") return std::make_unique<btBoxShape>(half_extents);
  if (kind == "plane") return std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), half_side);
  return std::make_unique<TurnedBox>();
}

DrapedSheet make_draped(const std::string& kind, unsigned number, double middle_x = 0) {
  return DrapedSheet(
      make_shape(kind),
      [](double, double, double gap) { return static_cast<double>(half_side) + gap; }, number,
      kind == "plane" ? 0 : 0.1, middle_x);
}

bool starts_behind_top(std::int32_t vertex, const bullet::RigidMotion& rigid,
                       const bullet::Motion& motion) {
  return rigid.start.invXform(bullet::to_bullet(motion.start_of(vertex))).y() <= half_side;
}

// Compares with the detector in one motion. Returns true if something touches.
bool compare_with_detector(bullet::FlatContacts& flat, DrapedSheet& draped, bool& is_clear,
                           bool& is_kept) {
  const bullet::StepTopology& topology = draped.reader().topology();
  const bullet::Motion& motion = draped.reader().motion();
  flat.set_topology();
  REQUIRE(flat.any());
  Detector exact;
  exact.set_topology(topology.for_detection());
  const bool touches = exact.detect(motion.starts(), motion.ends()).size() > 0;
  is_clear = flat.are_clear(false);
  CHECK(!(touches && is_clear));
  CHECK(!(exact.detect(motion.starts(), motion.starts()).size() > 0 && flat.are_clear(true)));
  std::vector<Contact> found;
  is_kept = flat.find_near(margin, found);
  CHECK(flat.any() == is_kept);
  CHECK(std::is_sorted(found.begin(), found.end()));
  for (const Contact& contact : found) {
    double length = 0;
    for (const float x : contact.normal) length += static_cast<double>(x) * static_cast<double>(x);
    CHECK(length == Approx(1).epsilon(1e-5));
    CHECK(contact.u >= 0);
    CHECK(contact.v >= 0);
    CHECK(contact.u + contact.v <= 1.0001f);
  }
  if (!is_kept) {
    CHECK(found.empty());
    return touches;
  }
  // Each vertex that the detector reports near a face is reported.
  DetectorOptions options;
  options.separation = margin;
  Detector near(options);
  near.set_topology(topology.for_detection());
  for (const Contact& contact : near.detect(motion.starts(), motion.ends())) {
    if (contact.kind != ContactKind::vertex_face || !topology.is_soft(contact.primitive_a))
      continue;
    CHECK(!starts_behind_top(contact.primitive_a, motion.rigid_of(contact.body_b), motion));
    CHECK(std::any_of(found.begin(), found.end(), [&](const Contact& other) {
      return other.primitive_a == contact.primitive_a && other.body_b == contact.body_b;
    }));
  }
  return touches;
}

}  // namespace

TEST_CASE("the faces of a box or a plane belong to the side that they lie in") {
  const std::string kind = GENERATE("box", "plane", "turned box");
  CAPTURE(kind);
  const auto shape = make_shape(kind);
  const bullet::AxisBox region{btVector3(-2, -2, -2), btVector3(2, 2, 2)};
  bullet::Triangles triangles;
  REQUIRE(bullet::tessellate(*shape, btTransform::getIdentity(), region, bullet::AxisBox::empty(),
                             margin, triangles));
  CHECK(triangles.is_flat());
  CHECK(!triangles.is_round());
  REQUIRE(triangles.flat_parts.size() == 1);
  const bullet::FlatPart& part = triangles.flat_parts.front();
  CHECK(part.sides.size() == (kind == "plane" ? 1 : 6));
  std::size_t count = 0;
  for (const bullet::FlatPart::Side& side : part.sides) {
    count += side.faces.size();
    CHECK(!side.faces.empty());
    for (const std::int32_t f : side.faces) {
      for (const std::int32_t v : triangles.faces[f])
        CHECK(side.normal.dot(triangles.vertices[v]) == Approx(half_side).epsilon(1e-6));
    }
  }
  CHECK(count == triangles.faces.size());
}

TEST_CASE("what is said to be clear of boxes and planes does not touch their triangles") {
  const std::string kind = GENERATE("box", "plane", "turned box");
  CAPTURE(kind);
  int clear = 0, touching = 0, kept = 0;
  for (unsigned number = 1; number <= 150; ++number) {
    CAPTURE(number);
    DrapedSheet draped = make_draped(kind, number);
    draped.read();
    bullet::FlatContacts flat(draped.reader().topology(), draped.reader().motion());
    bool is_clear = false, is_kept = false;
    touching += compare_with_detector(flat, draped, is_clear, is_kept);
    clear += is_clear;
    kept += is_kept;
  }
  CHECK(clear > 20);
  CHECK(touching > 20);
  CHECK(kept > 20);
}

TEST_CASE("a box whose edge a sheet comes near to is left to the detector") {
  int kept = 0;
  for (unsigned number = 1; number <= 50; ++number) {
    CAPTURE(number);
    DrapedSheet draped = make_draped("box", number, 0.35);
    draped.read();
    bullet::FlatContacts flat(draped.reader().topology(), draped.reader().motion());
    bool is_clear = false, is_kept = false;
    compare_with_detector(flat, draped, is_clear, is_kept);
    kept += is_kept;
  }
  CHECK(kept < 40);  // those that stay away from it
}

TEST_CASE("an obstacle that is not clear in three motions in succession is left to the detector") {
  for (unsigned number = 1; number <= 60; ++number) {
    DrapedSheet draped = make_draped("plane", number);
    draped.read();
    bullet::FlatContacts flat(draped.reader().topology(), draped.reader().motion());
    flat.set_topology();
    std::vector<Contact> found;
    if (!flat.find_near(margin, found) || flat.are_clear(false)) continue;
    CAPTURE(number);
    CHECK(flat.find_near(margin, found));
    CHECK(!flat.are_clear(false));
    CHECK(flat.find_near(margin, found));
    CHECK(!flat.are_clear(false));
    CHECK(!flat.find_near(margin, found));
    CHECK(!flat.any());
    return;
  }
  FAIL("no motion was unclear");
}
