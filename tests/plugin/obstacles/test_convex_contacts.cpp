// Boxes, cylinders, cones, hulls and planes as convex polyhedra, and compounds of them with a
// capsule: against their triangles and the detector.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <algorithm>
#include <cmath>
#include <limits>
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

constexpr double margin = 0.01;  // m
constexpr double size = 0.4;     // m: height of the top above the middle
constexpr auto half_side = static_cast<btScalar>(size);
const btVector3 half_extents(half_side, half_side, half_side);

// A compound of a box that is turned by a right angle; it owns the box.
struct TurnedBox : btCompoundShape {
  btBoxShape box{half_extents};
  TurnedBox() { addChildShape(btTransform(btQuaternion(btVector3(1, 0, 0), SIMD_HALF_PI)), &box); }
};

std::unique_ptr<btCollisionShape> make_hull() {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  auto hull = std::make_unique<btConvexHullShape>();
  for (int i = 0; i < 40; ++i) {
    const btVector3 x(static_cast<btScalar>(normal(random)), static_cast<btScalar>(normal(random)),
                      static_cast<btScalar>(normal(random)));
    hull->addPoint(half_side * x.normalized());
  }
  return hull;
}

// A box and a capsule, beside each other and equally high; it owns both.
struct BoxAndCapsule : btCompoundShape {
  btBoxShape box{half_extents};
  btCapsuleShapeZ capsule{half_side, 2 * half_side};
  BoxAndCapsule() {
    addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(-half_side, 0, 0)), &box);
    addChildShape(btTransform::getIdentity(), &capsule);
  }
};

std::unique_ptr<btCollisionShape> make_shape(const std::string& kind) {
  if (kind == "plane") return std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), half_side);
  if (kind == "turned box") return std::make_unique<TurnedBox>();
  if (kind == "cylinder") return std::make_unique<btCylinderShapeZ>(half_extents);
  if (kind == "cone") return std::make_unique<btConeShape>(half_side, 2 * half_side);
  if (kind == "hull") return make_hull();
  if (kind == "box and capsule") return std::make_unique<BoxAndCapsule>();
  return std::make_unique<btBoxShape>(half_extents);
}

// Height of a surface a gap above the shape, about in the middle of the sheet.
double height_above(const std::string& kind, double x, double z, double gap) {
  const double outside = size + gap;
  if (kind == "cylinder") return std::sqrt(outside * outside - x * x);
  if (kind == "hull") return std::sqrt(outside * outside - x * x - z * z) - 0.02;
  if (kind == "box and capsule")
    return std::sqrt(outside * outside - std::max(x, 0.0) * std::max(x, 0.0));
  if (kind == "cone") return size - 2 * std::hypot(x, z) + std::sqrt(5) * gap;
  if (kind == "edge of a box") return outside - std::max(0.0, 5 * (x - size));
  return outside;
}

DrapedSheet make_draped(const std::string& kind, unsigned number) {
  return DrapedSheet(
      make_shape(kind),
      [kind](double x, double z, double gap) { return height_above(kind, x, z, gap); }, number,
      kind == "plane" ? 0 : 0.1, kind == "edge of a box" ? size : 0);
}

bullet::Vector3d position(std::int32_t vertex, double time, const bullet::Motion& motion) {
  return (1 - time) * motion.start_of(vertex) + time * motion.end_of(vertex);
}

// The contact points at the time of the contact lie along its normal, unless they are together.
void check_contact(const Contact& contact, const bullet::Motion& motion) {
  const bullet::Vector3d normal(contact.normal[0], contact.normal[1], contact.normal[2]);
  CHECK(normal.norm() == Approx(1).epsilon(1e-5));
  bullet::Vector3d gap = bullet::Vector3d::Zero();
  for (std::size_t i = 0; i < 4; ++i)
    gap += contact.weights()[i] * position(contact.vertices[i], contact.toi, motion);
  CHECK(normal.dot(gap) > -1e-5);
  CHECK(contact.toi >= 0);
  CHECK(contact.toi <= 1);
  // An edge and its ridge are closest along the normal.
  if (contact.kind == ContactKind::edge_edge && gap.norm() > 1e-4)
    CHECK(normal.dot(gap) > 0.999 * gap.norm());
  for (const float x : {contact.u, contact.v}) {
    CHECK(x >= 0);
    CHECK(x <= 1);
  }
  if (contact.kind == ContactKind::vertex_face) CHECK(contact.u + contact.v <= 1.0001f);
}

struct Comparison {
  bool touches, is_clear, is_kept, any_edges;
};

// Compares with the detector in one motion.
Comparison compare_with_detector(DrapedSheet& draped) {
  DrapedContacts drape(draped);
  bullet::SimpleContacts& convex = drape.contacts;
  const bullet::StepTopology& topology = drape.topology;
  const bullet::Motion& motion = drape.motion;
  REQUIRE(convex.any());
  Detector exact;
  exact.set_topology(topology.for_detection());
  Comparison result = {};
  result.touches = exact.detect(motion.starts(), motion.ends()).size() > 0;
  result.is_clear = convex.are_clear(false);
  CHECK(!(result.touches && result.is_clear));
  CHECK(!(exact.detect(motion.starts(), motion.starts()).size() > 0 && convex.are_clear(true)));
  std::vector<Contact> found;
  result.is_kept = convex.find_near(margin, found);
  CHECK(convex.any() == result.is_kept);
  for (std::size_t i = 1; i < found.size(); ++i) CHECK(found[i - 1] < found[i]);
  for (const Contact& contact : found) {
    check_contact(contact, motion);
    result.any_edges = result.any_edges || contact.kind == ContactKind::edge_edge;
  }
  if (!result.is_kept) {
    CHECK(found.empty());
    return result;
  }
  CHECK(convex.are_clear(false) == result.is_clear);
  // Each vertex that the detector reports near a face is reported.
  DetectorOptions options;
  options.separation = margin;
  Detector near(options);
  near.set_topology(topology.for_detection());
  for (const Contact& contact : near.detect(motion.starts(), motion.ends())) {
    if (contact.kind != ContactKind::vertex_face || !topology.is_soft(contact.primitive_a))
      continue;
    CHECK(std::any_of(found.begin(), found.end(), [&](const Contact& other) {
      return other.kind == ContactKind::vertex_face && other.primitive_a == contact.primitive_a &&
             other.body_b == contact.body_b;
    }));
  }
  return result;
}

}  // namespace

TEST_CASE("each triangle of a convex shape belongs to the side that it lies in") {
  const std::string kind = GENERATE("box", "plane", "turned box", "cylinder", "cone", "hull");
  CAPTURE(kind);
  const auto shape = make_shape(kind);
  const bullet::AxisBox region{btVector3(-2, -2, -2), btVector3(2, 2, 2)};
  bullet::Triangles triangles;
  REQUIRE(bullet::tessellate(*shape, btTransform::getIdentity(), region, bullet::AxisBox::empty(),
                             margin, triangles));
  CHECK(triangles.is_simple());
  CHECK(!triangles.is_round());
  REQUIRE(triangles.convex_parts.size() == 1);
  const bullet::ConvexPart& part = triangles.convex_parts.front();
  std::size_t count = 0;
  for (const bullet::ConvexPart::Side& side : part.sides) {
    count += side.faces.size();
    const btScalar reach = side.normal.dot(triangles.vertices[triangles.faces[side.faces[0]][0]]);
    for (const std::int32_t f : side.faces) {
      for (const std::int32_t v : triangles.faces[f])
        CHECK(side.normal.dot(triangles.vertices[v]) == Approx(reach).margin(1e-4));
    }
    for (const btVector3& x : triangles.vertices)
      CHECK(side.normal.dot(x) <= reach + btScalar(1e-4));
  }
  CHECK(count == triangles.faces.size());
  const bool is_box = kind == "box" || kind == "turned box";
  if (is_box || kind == "plane") CHECK(part.sides.size() == (is_box ? 6 : 1));
  // Euler: vertices - edges + faces = 2.
  if (kind != "plane")
    CHECK(triangles.vertices.size() - part.ridges.size() + part.sides.size() == 2);
  for (const bullet::ConvexPart::Ridge& ridge : part.ridges) {
    CHECK(ridge.sides[0] < ridge.sides[1]);
    CHECK(triangles.faces[ridge.face][ridge.corner] == ridge.vertices[0]);
    CHECK(triangles.faces[ridge.face][(ridge.corner + 1) % 3] == ridge.vertices[1]);
  }
}

TEST_CASE("what is said to be clear of convex shapes does not touch their triangles") {
  const std::string kind = GENERATE("box", "edge of a box", "plane", "turned box", "cylinder",
                                    "cone", "hull", "box and capsule");
  CAPTURE(kind);
  int clear = 0, touching = 0, kept = 0, edges = 0;
  for (unsigned number = 1; number <= 150; ++number) {
    CAPTURE(number);
    DrapedSheet draped = make_draped(kind, number);
    draped.read();
    const Comparison result = compare_with_detector(draped);
    touching += result.touches;
    clear += result.is_clear;
    kept += result.is_kept;
    edges += result.any_edges;
  }
  // By chance, and other numbers in each precision; all of these must happen.
  CHECK(clear > 10);
  CHECK(touching > 10);
  CHECK(kept > 10);
  if (kind == "edge of a box" || kind == "cone" || kind == "hull") CHECK(edges > 20);
  if (kind == "plane") CHECK(edges == 0);
}

TEST_CASE("an obstacle that is not clear in many motions in succession is left to the detector") {
  constexpr int most_motions = 32;
  const std::string kind = GENERATE("plane", "box and capsule");
  for (unsigned number = 1; number <= 60; ++number) {
    DrapedSheet draped = make_draped(kind, number);
    draped.read();
    DrapedContacts drape(draped);
    bullet::SimpleContacts& convex = drape.contacts;
    std::vector<Contact> found;
    if (!convex.find_near(margin, found) || convex.are_clear(false)) continue;
    CAPTURE(number);
    for (int i = 1; i < most_motions; ++i) {
      CHECK(convex.find_near(margin, found));
      CHECK(!convex.are_clear(false));
    }
    CHECK(!convex.find_near(margin, found));
    CHECK(!convex.any());
    return;
  }
  FAIL("no motion was unclear");
}

TEST_CASE("convex contacts keep what they know of the vertices from one motion to the next") {
  const std::string kind =
      GENERATE("box", "edge of a box", "cylinder", "cone", "hull", "box and capsule");
  CAPTURE(kind);
  int clear = 0, touching = 0;
  for (unsigned number = 1; number <= 40; ++number) {
    CAPTURE(number);
    DrapedSheet draped = make_draped(kind, number);
    draped.read();
    DrapedContacts drape(draped);
    bullet::SimpleContacts& convex = drape.contacts;
    bullet::Motion& motion = drape.motion;
    Detector exact;
    exact.set_topology(drape.topology.for_detection());
    std::vector<Contact> found;
    if (!convex.find_near(margin, found)) continue;
    for (int i = 0; i < 6; ++i) {  // other ends of the same motion, as the response makes them
      for (std::int32_t v = 0; v < motion.soft_count(); ++v)
        motion.end[3 * static_cast<std::size_t>(v) + 1] +=
            static_cast<btScalar>(draped.within(-0.004, 0.004));
      const bool touches = exact.detect(motion.starts(), motion.ends()).size() > 0;
      const bool is_clear = convex.are_clear(false);
      CHECK(!(touches && is_clear));
      clear += is_clear;
      touching += touches;
    }
  }
  CHECK(clear > 0);
  CHECK(touching > 0);
}

TEST_CASE("what is not finite is never clear of a convex shape") {
  const std::string kind = GENERATE("box", "plane", "box and capsule");
  const bool of_obstacle = GENERATE(false, true);
  const btScalar value = GENERATE(std::numeric_limits<btScalar>::quiet_NaN(),
                                  std::numeric_limits<btScalar>::infinity());
  CAPTURE(kind, of_obstacle, value);
  DrapedSheet draped = make_draped(kind, 1);
  draped.read();
  DrapedContacts drape(draped);
  bullet::SimpleContacts& convex = drape.contacts;
  bullet::Motion& motion = drape.motion;
  const auto vertex =
      static_cast<std::size_t>(of_obstacle ? motion.soft_count() : motion.soft_count() - 1);
  motion.end[3 * vertex + 1] = value;
  CHECK(!convex.are_clear(false));
  CHECK(convex.are_clear(true));
  std::vector<Contact> found;
  CHECK(!convex.find_near(margin, found));
}

TEST_CASE("hulls without volume and hulls of many sides are no convex parts") {
  const int kind = GENERATE(0, 1, 2);  // points in a line, equal points, a finely divided ball
  CAPTURE(kind);
  btCompoundShape compound;
  btBoxShape box(half_extents);
  btConvexHullShape hull;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < (kind == 2 ? 500 : 5); ++i) {
    const btVector3 x(static_cast<btScalar>(normal(random)), static_cast<btScalar>(normal(random)),
                      static_cast<btScalar>(normal(random)));
    hull.addPoint(kind == 2 ? x.normalized() : btVector3(kind == 0 ? btScalar(i) : 0, 0, 0));
  }
  compound.addChildShape(btTransform::getIdentity(), &box);
  compound.addChildShape(btTransform::getIdentity(), &hull);
  const bullet::AxisBox region{btVector3(-2, -2, -2), btVector3(2, 2, 2)};
  bullet::Triangles triangles;
  bullet::tessellate(compound, btTransform::getIdentity(), region, bullet::AxisBox::empty(), margin,
                     triangles);
  for (const bullet::ConvexPart& part : triangles.convex_parts) {
    CHECK(!part.sides.empty());
    CHECK(part.sides.size() <= bullet::ConvexPart::max_sides);
  }
  if (kind == 2) CHECK(!triangles.is_simple());
}

TEST_CASE("an edge that several ridges of a hull form is met at the nearest one") {
  // A block with points along its upper edges, and a sheet that bends around one of them.
  DrapedSheet draped(
      [] {
        auto hull = std::make_unique<btConvexHullShape>();
        for (int i = 0; i <= 8; ++i)
          for (const btScalar x : {-half_side, half_side})
            for (const btScalar y : {-half_side, half_side})
              hull->addPoint(btVector3(x, y, half_side * btScalar(i - 4) / 4));
        return hull;
      }(),
      [](double x, double z, double gap) {
        return height_above("edge of a box", x, z, 0.005 + 0 * gap);
      },
      3, 0, size);
  draped.read();
  DrapedContacts drape(draped);
  const bullet::Motion& motion = drape.motion;
  std::vector<Contact> found;
  REQUIRE(drape.contacts.find_near(margin, found));
  int edges = 0;
  for (const Contact& contact : found) {
    check_contact(contact, motion);
    if (contact.kind != ContactKind::edge_edge) continue;
    ++edges;
    CHECK(std::abs(contact.normal[2]) < 0.5f);
  }
  CHECK(edges > 5);
}
