#include "response/impact_zones.h"

#include <random>
#include <vector>

#include "plugin/support/contacts.h"
#include "support/catch.h"

using namespace lazyccd;
using bullet::Vector3d;

namespace {

constexpr std::int32_t large = 5000, small = 8, small_count = 300;
constexpr std::int32_t held = large, pinned = large + small;  // first nodes of two small zones

// A cloud of nodes of one soft body that flow and jitter, with contacts that make one large zone
// of the first nodes and small ones of the others.
struct Cloud {
  bullet::Motion motion;
  std::vector<Contact> contacts;

  Cloud() {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> any(-1, 1);
    const std::int32_t count = large + small * small_count;
    motion.input().dt = 0.01;
    for (std::int32_t v = 0; v < count; ++v) {
      for (int axis = 0; axis < 3; ++axis) {
        motion.input().start.push_back(static_cast<btScalar>(any(random)));
        motion.end.push_back(motion.start().back() +
                             static_cast<btScalar>(0.03 + 0.01 * any(random)));
      }
      motion.input().inverse_mass.push_back(v == pinned ? 0 : 500 + 400 * any(random));
      motion.input().shortest_edge.push_back(0.1);
    }
    motion.input().first_vertex = {0, count};
    motion.input().rigid_of_body = {-1};
    for (std::int32_t v = 0; v + 3 < count; ++v) {
      const std::int32_t last = v + 3;
      if (v < large ? last < large : (v - large) / small == (last - large) / small)
        contacts.push_back(
            lazyccd::test::contact(ContactKind::vertex_face, {v, v + 1, v + 2, last}, 0, 0));
    }
    motion.begin_response();
  }

  // Of the nodes [first, last), times the time step.
  Vector3d momentum(std::int32_t first, std::int32_t last) const {
    Vector3d sum = Vector3d::Zero();
    for (std::int32_t v = first; v < last; ++v)
      sum += (motion.solved[v] - motion.start_of(v)) / motion.inverse_mass()[v];
    return sum;
  }
};

// Absorbs all contacts, then holds those of one zone.
std::int64_t move(Cloud& cloud, int thread_count) {
  const Threads threads(thread_count);
  bullet::ImpactZones zones(cloud.motion, threads);
  CHECK(zones.absorb(cloud.contacts, cloud.motion));
  CHECK_FALSE(zones.absorb(cloud.contacts, cloud.motion));
  std::vector<Contact> to_hold;
  for (const Contact& contact : cloud.contacts) {
    if (contact.vertices[0] >= held && contact.vertices[0] < held + small)
      to_hold.push_back(contact);
  }
  CHECK(zones.hold(to_hold, false, cloud.motion));
  CHECK(zones.held_count() == small);
  return zones.node_count();
}

}  // namespace

TEST_CASE("the motion of impact zones does not depend on the number of threads") {
  Cloud expected;
  move(expected, 1);
  for (const int threads : {2, 3, 16}) {
    Cloud cloud;
    move(cloud, threads);
    CHECK(cloud.motion.end == expected.motion.end);
    CHECK(cloud.motion.solved == expected.motion.solved);
  }
}

TEST_CASE("impact zones are rigid and keep momentum") {
  Cloud before, cloud;
  CHECK(move(cloud, 2) == large + small * small_count - 1);  // all but the pinned node
  const bullet::Motion& motion = cloud.motion;
  const auto is_rigid = [&](std::int32_t a, std::int32_t b) {
    return (motion.solved[a] - motion.solved[b]).norm() ==
           Approx((motion.start_of(a) - motion.start_of(b)).norm());
  };
  CHECK((cloud.momentum(0, large) - before.momentum(0, large)).norm() < 1e-12);
  for (std::int32_t v = 1; v < large; ++v) REQUIRE(is_rigid(0, v));
  for (std::int32_t first = large; first < motion.soft_count(); first += small) {
    for (std::int32_t v = first + 1; v < first + small; ++v) {
      if (first == pinned) {  // the others follow it
        const Vector3d moved = motion.end_of(pinned) - motion.start_of(pinned);
        REQUIRE((motion.solved[v] - motion.start_of(v) - moved).norm() < 1e-12);
      } else {
        REQUIRE(is_rigid(first, v));
      }
    }
    if (first == pinned) continue;
    const std::int32_t last = first + small;
    REQUIRE((cloud.momentum(first, last) - before.momentum(first, last)).norm() < 1e-12);
  }
  for (std::int32_t v = held; v < held + small; ++v) CHECK(motion.end_of(v) == motion.start_of(v));
}
