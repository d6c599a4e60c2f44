// Balls and capsules as what they are: against their triangles and the detector.
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

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

constexpr btScalar radius = btScalar(0.3);
constexpr double sheet_margin = 0.01;  // m

// A compound of two balls that owns them.
struct TwoBalls : btCompoundShape {
  btSphereShape first{radius}, second{radius};
  TwoBalls() {
    const btQuaternion turned(btVector3(0, 0, 1), btScalar(0.4));
    addChildShape(btTransform(turned, btVector3(btScalar(-0.2), 0, 0)), &first);
    addChildShape(btTransform(turned, btVector3(btScalar(0.2), 0, btScalar(0.1))), &second);
  }
};

// Of what is small beside the faces of the sheet.
constexpr btScalar small_radius = btScalar(0.03);

bool is_small(const std::string& kind) { return kind == "small ball" || kind == "thin capsule"; }

std::unique_ptr<btCollisionShape> make_round_shape(const std::string& kind) {
  if (kind == "small ball") return std::make_unique<btSphereShape>(small_radius);
  if (kind == "thin capsule") return std::make_unique<btCapsuleShapeX>(small_radius, btScalar(0.4));
  if (kind == "ball") return std::make_unique<btSphereShape>(radius);
  if (kind == "capsule") return std::make_unique<btCapsuleShapeX>(radius, btScalar(0.4));
  return std::make_unique<TwoBalls>();
}

DrapedSheet drape_over_round(const std::string& kind, unsigned number) {
  const bool is_curved = kind == "ball";
  const auto r = static_cast<double>(is_small(kind) ? small_radius : radius);
  return DrapedSheet(
      make_round_shape(kind),
      [is_curved, r](double x, double z, double gap) {
        const double outside = r + gap;
        return std::sqrt(outside * outside - (is_curved ? x * x + z * z : 0));
      },
      number, 0.3, 0, is_small(kind) ? 5 : 13);
}

// Whether a vertex starts in a ball or capsule of the obstacle.
bool starts_inside(std::int32_t vertex, const bullet::StepTopology::BodyRecord& obstacle,
                   const bullet::RigidMotion& rigid, const bullet::Motion& motion) {
  const btVector3 x = rigid.start.invXform(bullet::to_bullet(motion.start_of(vertex)));
  const auto& parts = obstacle.triangles->round_parts;
  return std::any_of(parts.begin(), parts.end(), [&](const bullet::RoundPart& part) {
    const btScalar along = bullet::closest_on_segment(x, part.core[0], part.core[1]);
    return static_cast<double>(x.distance(part.core[0].lerp(part.core[1], along))) <
           part.outer_radius;
  });
}

// Distance of the contact's soft point from the nearest ball or capsule at the time of impact.
double gap_of(const Contact& contact, std::int32_t obstacle, const bullet::StepTopology& topology,
              const bullet::Motion& motion) {
  const std::array<double, 4> weights = contact.weights();
  bullet::Vector3d point = bullet::Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    if (!topology.is_soft(v)) continue;
    point += std::abs(weights[i]) *
             ((1 - contact.toi) * motion.start_of(v) + contact.toi * motion.end_of(v));
  }
  double gap = std::numeric_limits<double>::infinity();
  for (const bullet::RoundPart& part : topology.bodies()[obstacle].triangles->round_parts) {
    const bullet::MovingCore core(part, motion.rigid_of(obstacle), false);
    gap = std::min(gap, core.distance(point, contact.toi) - part.outer_radius);
  }
  return gap;
}

}  // namespace

TEST_CASE("a ray from the core of a ball or capsule leaves through the face that it is told") {
  const std::string kind = GENERATE("ball", "capsule", "two balls");
  CAPTURE(kind);
  const auto shape = make_round_shape(kind);
  bullet::Triangles triangles;
  REQUIRE(bullet::tessellate(*shape, btTransform::getIdentity(), bullet::AxisBox::empty(),
                             bullet::AxisBox::empty(), 0.5 * sheet_margin, triangles));
  CHECK(triangles.is_round());
  std::mt19937 random(7);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform;
  for (const bullet::RoundPart& part : triangles.round_parts) {
    CHECK(part.outer_radius == Approx(static_cast<double>(radius)).epsilon(1e-5));
    CHECK(part.inner_radius > static_cast<double>(radius) - 0.6 * sheet_margin);
    for (int i = 0; i < 300; ++i) {
      const btVector3 direction =
          btVector3(static_cast<btScalar>(gauss(random)), static_cast<btScalar>(gauss(random)),
                    static_cast<btScalar>(gauss(random)))
              .normalized();
      const btVector3 from =
          part.core[0].lerp(part.core[1], static_cast<btScalar>(uniform(random)));
      const bullet::FacePoint exit = bullet::find_exit(part, from, direction);
      const Face& face = triangles.faces[static_cast<std::size_t>(part.first_face + exit.face)];
      const btVector3 at = (1 - exit.u - exit.v) * triangles.vertices[face[0]] +
                           exit.u * triangles.vertices[face[1]] +
                           exit.v * triangles.vertices[face[2]];
      CHECK((at - from).cross(direction).length() < btScalar(1e-4));
      CHECK((at - from).dot(direction) > 0);
    }
  }
}

TEST_CASE("what is said to be clear of balls and capsules does not touch their triangles") {
  const std::string kind = GENERATE("ball", "capsule", "two balls", "small ball", "thin capsule");
  CAPTURE(kind);
  int clear = 0, touching = 0, of_faces_or_edges = 0, within = 0, reported = 0;
  for (unsigned number = 1; number <= 150; ++number) {
    CAPTURE(number);
    DrapedSheet draped = drape_over_round(kind, number);
    draped.read();
    DrapedContacts drape(draped);
    bullet::SimpleContacts& round = drape.contacts;
    const bullet::StepTopology& topology = drape.topology;
    const bullet::Motion& motion = drape.motion;
    REQUIRE(round.any());
    Detector exact;
    exact.set_topology(topology.for_detection());
    const bool touches = exact.detect(motion.starts(), motion.ends()).size() > 0;
    const bool is_clear = round.are_clear(false);
    CHECK(!(touches && is_clear));
    clear += is_clear;
    touching += touches;
    CHECK(!(exact.detect(motion.starts(), motion.starts()).size() > 0 && round.are_clear(true)));

    // Each vertex that the detector reports near a face is reported.
    DetectorOptions options;
    options.separation = sheet_margin;
    Detector near(options);
    near.set_topology(topology.for_detection());
    std::vector<Contact> found;
    round.find_near(sheet_margin, found);
    CHECK(std::is_sorted(found.begin(), found.end()));
    for (const Contact& contact : near.detect(motion.starts(), motion.ends())) {
      if (contact.kind != ContactKind::vertex_face || !topology.is_soft(contact.primitive_a))
        continue;
      if (starts_inside(contact.primitive_a, topology.bodies()[contact.body_b],
                        motion.rigid_of(contact.body_b), motion))
        continue;
      CHECK(std::any_of(found.begin(), found.end(), [&](const Contact& other) {
        return other.primitive_a == contact.primitive_a && other.body_b == contact.body_b;
      }));
    }
    for (const Contact& contact : found) {
      const std::int32_t soft = contact.body_a < contact.body_b ? contact.body_a : contact.body_b;
      const std::int32_t obstacle = contact.body_a + contact.body_b - soft;
      const bool of_vertex =
          topology.is_soft(contact.vertices[0]) && contact.kind == ContactKind::vertex_face;
      of_faces_or_edges += !of_vertex;
      within += gap_of(contact, obstacle, topology, motion) <= sheet_margin + 1e-4;
      ++reported;
      double length = 0;
      for (const float x : contact.normal)
        length += static_cast<double>(x) * static_cast<double>(x);
      CHECK(length == Approx(1).epsilon(1e-5));
      CHECK(contact.u >= 0);
      CHECK(contact.v >= 0);
      if (contact.kind == ContactKind::vertex_face)
        CHECK(contact.u + contact.v <= 1.0001f);
      else
        CHECK(std::max(contact.u, contact.v) <= 1);
    }
  }
  CHECK(clear > 20);
  CHECK(touching > 20);
  CHECK((of_faces_or_edges > 100) == is_small(kind));
  CHECK(within > 0.8 * reported);  // what only passes by may be farther away
}

TEST_CASE("nodes that are anchored to a ball or capsule do not keep the rest from being clear") {
  const std::string kind = GENERATE("ball", "capsule", "small ball");
  const int anchored = GENERATE(1, 2);
  CAPTURE(kind, anchored);
  int clear = 0, touching = 0;
  for (unsigned number = 1; number <= 100; ++number) {
    CAPTURE(number);
    DrapedSheet draped = drape_over_round(kind, number);
    if (anchored == 1)
      draped.anchor({0});
    else
      draped.anchor({1, 2});
    draped.read();
    DrapedContacts drape(draped);
    bullet::SimpleContacts& round = drape.contacts;
    const bullet::Motion& motion = drape.motion;
    std::vector<std::int32_t> found;
    drape.filter.find_anchored(0, 1, found);
    CHECK(found.size() == static_cast<std::size_t>(anchored));
    REQUIRE(round.any());
    Detector exact;
    exact.set_topology(drape.topology.for_detection());
    for (const bool at_start : {false, true}) {
      CAPTURE(at_start);
      const Span<const Contact> contacts =
          exact.detect(motion.starts(), at_start ? motion.starts() : motion.ends());
      const bool touches = std::any_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
        return drape.filter.verdict(c) != bullet::ContactFilter::Verdict::ignore;
      });
      const bool is_clear = round.are_clear(at_start);
      CHECK(!(touches && is_clear));
      clear += is_clear;
      touching += touches;
    }
  }
  CHECK(clear > 20);
  CHECK(touching > 20);
}
