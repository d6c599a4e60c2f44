// Balls and capsules as what they are: against their triangles and the detector.
#include "detection/round_contacts.h"

#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <cmath>
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
constexpr double margin = 0.01;  // m

// A compound of two balls that owns them.
struct TwoBalls : btCompoundShape {
  btSphereShape first{radius}, second{radius};
  TwoBalls() {
    const btQuaternion turned(btVector3(0, 0, 1), btScalar(0.4));
    addChildShape(btTransform(turned, btVector3(btScalar(-0.2), 0, 0)), &first);
    addChildShape(btTransform(turned, btVector3(btScalar(0.2), 0, btScalar(0.1))), &second);
  }
};

std::unique_ptr<btCollisionShape> make_shape(const std::string& kind) {
  if (kind == "ball") return std::make_unique<btSphereShape>(radius);
  if (kind == "capsule") return std::make_unique<btCapsuleShapeX>(radius, btScalar(0.4));
  return std::make_unique<TwoBalls>();
}

DrapedSheet make_draped(const std::string& kind, unsigned number) {
  const bool is_curved = kind == "ball";
  return DrapedSheet(
      make_shape(kind),
      [is_curved](double x, double z, double gap) {
        const double outside = static_cast<double>(radius) + gap;
        return std::sqrt(outside * outside - (is_curved ? x * x + z * z : 0));
      },
      number);
}

// Whether a vertex starts in a ball or capsule of the obstacle.
bool starts_inside(std::int32_t vertex, const bullet::StepTopology::BodyRecord& obstacle,
                   const bullet::RigidMotion& rigid, const bullet::Motion& motion) {
  const btVector3 x = rigid.start.invXform(bullet::to_bullet(motion.start_of(vertex)));
  const auto& parts = obstacle.triangles->round_parts;
  return std::any_of(parts.begin(), parts.end(), [&](const bullet::RoundPart& part) {
    const btScalar along = bullet::closest_on_segment(x, part.core[0], part.core[1]);
    return x.distance(part.core[0].lerp(part.core[1], along)) < radius;
  });
}

}  // namespace

TEST_CASE("a ray from the core of a ball or capsule leaves through the face that it is told") {
  const std::string kind = GENERATE("ball", "capsule", "two balls");
  CAPTURE(kind);
  const auto shape = make_shape(kind);
  bullet::Triangles triangles;
  REQUIRE(bullet::tessellate(*shape, btTransform::getIdentity(), bullet::AxisBox::empty(),
                             bullet::AxisBox::empty(), 0.5 * margin, triangles));
  CHECK(triangles.is_round());
  std::mt19937 random(7);
  std::normal_distribution<double> gauss;
  std::uniform_real_distribution<double> uniform;
  for (const bullet::RoundPart& part : triangles.round_parts) {
    CHECK(part.outer_radius == Approx(static_cast<double>(radius)).epsilon(1e-5));
    CHECK(part.inner_radius > static_cast<double>(radius) - 0.6 * margin);
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
  const std::string kind = GENERATE("ball", "capsule", "two balls");
  CAPTURE(kind);
  int clear = 0, touching = 0;
  for (unsigned number = 1; number <= 150; ++number) {
    CAPTURE(number);
    DrapedSheet draped = make_draped(kind, number);
    draped.read();
    const bullet::StepTopology& topology = draped.reader().topology();
    const bullet::Motion& motion = draped.reader().motion();
    const bullet::PairSurfaces surfaces = surfaces_of(topology);
    bullet::RoundContacts round(topology, motion, surfaces);
    round.set_topology();
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
    options.separation = margin;
    Detector near(options);
    near.set_topology(topology.for_detection());
    std::vector<Contact> found;
    round.find_near(margin, found);
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
      double length = 0;
      for (const float x : contact.normal)
        length += static_cast<double>(x) * static_cast<double>(x);
      CHECK(length == Approx(1).epsilon(1e-5));
      CHECK(contact.u >= 0);
      CHECK(contact.v >= 0);
      CHECK(contact.u + contact.v <= 1.0001f);
    }
  }
  CHECK(clear > 20);
  CHECK(touching > 20);
}
