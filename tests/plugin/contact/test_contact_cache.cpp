// ContactCache: near contacts of an earlier step hold as long as nothing moves, and then nothing
// that touches is overlooked.
#include "contact/contact_cache.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "plugin/support/contacts.h"
#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;
using lazyccd::test::ObstacleWorld;
using scenes::World;

namespace {

// Bodies of one vertex, which stay where they are.
Motion two_bodies(const btVector3& a, const btVector3& b) {
  Motion motion;
  motion.input().first_vertex = {0, 1, 2};
  for (const btVector3& x : {a, b})
    for (int k = 0; k < 3; ++k) motion.input().start.push_back(x[k]);
  motion.end = motion.start();
  return motion;
}

btVector3 vector(double x, double y, double z) {
  return btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), static_cast<btScalar>(z));
}

Motion three_bodies() {
  Motion motion = two_bodies(vector(0, 0, 0), vector(0, 1, 0));
  for (std::vector<btScalar>* positions : {&motion.input().start, &motion.end})
    positions->insert(positions->end(), {2, 2, 2});
  motion.input().first_vertex = {0, 1, 2, 3};
  return motion;
}

std::vector<double> near(double distance, std::size_t bodies) {
  return std::vector<double>(bodies, distance);
}

double largest_distance(const btSoftBody& a, const btSoftBody& b) {
  double largest = 0;
  for (int i = 0; i < a.m_nodes.size(); ++i)
    largest = std::max<double>(largest, a.m_nodes[i].m_x.distance(b.m_nodes[i].m_x));
  return largest;
}

double lowest(const btSoftBody& body) {
  double lowest = 1e30;
  for (int i = 0; i < body.m_nodes.size(); ++i)
    lowest = std::min<double>(lowest, body.m_nodes[i].m_x.y());
  return lowest;
}

// A sheet that falls on a table, hangs over its edges a little, and comes to rest. The table is a
// mesh with its top at y = 0.
struct RestingSheet {
  std::unique_ptr<btTriangleMesh> triangles = test::box_triangles(0.3);
  ObstacleWorld world;
  btRigidBody* table;
  btSoftBody* sheet;

  explicit RestingSheet(World kind, bool contact_cache = true)
      : world(kind, 10, options(contact_cache)),
        table(world.add(std::make_unique<btBvhTriangleMeshShape>(triangles.get(), true),
                        vector(0, -0.3, 0))),
        sheet(world.add_sheet(12, 0.7, 0.05, 0)) {
    sheet->m_cfg.kDP = btScalar(0.02);
    world.steps(720);
  }
  static SolverOptions options(bool contact_cache) {
    SolverOptions options;
    options.contact_cache = contact_cache;
    return options;
  }
};

}  // namespace

TEST_CASE("a contact cache holds while every vertex starts and ends nearly where it did") {
  const Motion before = two_bodies(vector(0, 0, 0), vector(0, 1, 0));
  const std::vector<double> distances = {1, 1};
  ContactCache cache;
  CHECK(!cache.begin(before, distances));
  cache.take({}, near(0.5, 2));
  CHECK(cache.begin(before, distances));
  Motion after = before;
  SECTION("a little") {
    after.end[4] = btScalar(1.012);
    CHECK(cache.begin(after, distances));
  }
  SECTION("too far at the end") {
    after.end[4] = btScalar(1.014);
    CHECK(!cache.begin(after, distances));
    CHECK(!cache.begin(after, distances));  // nothing was found yet
    cache.take({}, near(0.5, 2));
    CHECK(cache.begin(after, distances));
  }
  SECTION("too far at the start") {
    after.input().start[0] = btScalar(-0.014);
    CHECK(!cache.begin(after, distances));
  }
  SECTION("little by little") {
    after.end[4] = btScalar(1.012);
    CHECK(cache.begin(after, distances));
    after.end[4] = btScalar(1.014);
    CHECK(!cache.begin(after, distances));
  }
  SECTION("other vertices") {
    after.input().start.resize(3);
    after.input().first_vertex = {0, 1};
    CHECK(!cache.begin(after, {distances.data(), 1}));
  }
  SECTION("not a number") {
    after.end[1] = std::numeric_limits<btScalar>::quiet_NaN();
    CHECK(!cache.begin(after, distances));
  }
  SECTION("forgotten") {
    cache.forget();
    CHECK(!cache.begin(before, distances));
  }
}

TEST_CASE("a contact cache keeps the contacts of bodies that stay, and of no others") {
  const auto contact = [](std::int32_t a, std::int32_t b, float u) {
    Contact made = test::contact(ContactKind::vertex_face, {0, 1, 2, 3}, 0, 0);
    made.body_a = a;
    made.body_b = b;
    made.u = u;
    return made;
  };
  Motion motion = three_bodies();
  const std::vector<double> distances = {1, 1, 1};
  ContactCache cache;
  CHECK(!cache.begin(motion, distances));
  cache.take({contact(0, 1, 0), contact(0, 2, 0), contact(1, 2, 0)}, near(0.5, 3));
  motion.end[8] += 1;  // of body 2
  CHECK(!cache.begin(motion, distances));
  const Span<const char> stays = cache.stays();
  CHECK(std::vector<char>(stays.begin(), stays.end()) == std::vector<char>{1, 1, 0});
  cache.take({contact(1, 2, 0.5F)}, near(0.5, 3));
  const Span<const Contact> found = cache.contacts();
  REQUIRE(found.size() == 2);
  CHECK(found[0].body_b == 1);
  CHECK(found[0].u == 0);
  CHECK(found[1].body_b == 2);
  CHECK(found[1].u == 0.5F);
}

TEST_CASE("a contact cache knows that nothing touches while vertices move together") {
  const Motion before = two_bodies(vector(0, 0, 0), vector(0, 1, 0));
  const std::vector<double> distances = {1, 1};
  ContactCache cache;
  cache.begin(before, distances);
  cache.take({}, near(0.5, 2));
  REQUIRE(cache.begin(before, distances));
  CHECK(cache.keeps_apart(two_bodies(vector(3, 0, 2), vector(3, 1, 2)), false));
  Motion nearer = before;
  nearer.end[4] = btScalar(0.51);
  CHECK(cache.keeps_apart(nearer, false));
  nearer.end[4] = btScalar(0.49);
  CHECK(!cache.keeps_apart(nearer, false));
  CHECK(cache.keeps_apart(nearer, true));
  nearer.end[4] = std::numeric_limits<btScalar>::quiet_NaN();
  CHECK(!cache.keeps_apart(nearer, false));
}

TEST_CASE("a contact cache answers for bodies that stay, whatever others do") {
  Motion motion = three_bodies();
  const std::vector<double> distances = {1, 1, 1};
  ContactCache cache;
  cache.begin(motion, distances);
  CHECK(cache.keeps_apart(motion, false));  // no body stays
  cache.take({}, std::vector<double>{0.5, 0.5, 0});
  // The third body is close to something and moves far.
  motion.end[8] += 9;
  CHECK(!cache.begin(motion, distances));
  CHECK(cache.keeps_apart(motion, false));
  cache.take({}, std::vector<double>{0, 0, 0.5});  // only what moved was searched
  CHECK(cache.begin(motion, distances));
  motion.end[4] = btScalar(0.4);
  CHECK(!cache.keeps_apart(motion, false));
}

TEST_CASE("a contact cache knows how far a body had moved when the other one was searched") {
  Motion motion = two_bodies(vector(0, 0, 0), vector(0, 1, 0));
  const std::vector<double> distances = {1, 1};
  ContactCache cache;
  cache.begin(motion, distances);
  cache.take({}, near(0.5, 2));
  // The first body moves away by 0.012. Then the second one moves and is searched: 0.2 apart.
  motion.input().start[1] = motion.end[1] = btScalar(-0.012);
  motion.input().start[4] = motion.end[4] = btScalar(0.188);
  REQUIRE(!cache.begin(motion, distances));
  cache.take({}, near(0.2, 2));
  // The first body returns, and the second one comes nearer.
  motion.input().start[1] = motion.end[1] = 0;
  REQUIRE(cache.begin(motion, distances));
  motion.end[4] -= btScalar(0.17);
  CHECK(cache.keeps_apart(motion, false));
  motion.end[4] -= btScalar(0.01);
  CHECK(!cache.keeps_apart(motion, false));
}

TEST_CASE("a contact cache searches again where something is nearly closed") {
  const double gap = GENERATE(0.05, 0.2);
  CAPTURE(gap);
  const Motion motion = two_bodies(vector(0, gap, 0), vector(0, 0, 0));
  const std::vector<double> distances = {1, 1};
  ContactCache cache;
  CHECK(!cache.begin(motion, distances));
  cache.take({}, near(gap, 2));
  CHECK(cache.begin(motion, distances) == (gap > 0.1));
}

TEST_CASE("a sheet that rests keeps its contacts") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind);
  RestingSheet cached(kind);
  const std::int64_t before = cached.world.total().cached_detections;
  cached.world.steps(60);
  CHECK(cached.world.total().cached_detections - before > 45);
  RestingSheet searched(kind, false);
  searched.world.steps(60);
  CHECK(searched.world.total().cached_detections == 0);
  // The thickness is 0.02. Corners hang down and swing, so the two motions differ a little.
  CHECK(largest_distance(*cached.sheet, *searched.sheet) < 0.01);
}

TEST_CASE("contacts that were kept end when their obstacle moves on or is taken away") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind);
  RestingSheet scene(kind);
  REQUIRE(scene.world.total().cached_detections > 0);
  SECTION("it rises and carries the sheet") {
    scene.table->setCollisionFlags(scene.table->getCollisionFlags() |
                                   btCollisionObject::CF_KINEMATIC_OBJECT);
    for (int i = 0; i < 120; ++i) {
      btTransform pose = scene.table->getWorldTransform();
      pose.setOrigin(pose.getOrigin() + vector(0, 0.005, 0));
      scene.table->setWorldTransform(pose);
      scene.world.steps(1);
    }
    const int middle = 12 * 6 + 6;
    CHECK(scene.sheet->m_nodes[middle].m_x.y() > btScalar(0.6));
  }
  SECTION("the sheet falls") {
    scene.world.world().removeRigidBody(scene.table);
    scene.world.steps(120);
    CHECK(lowest(*scene.sheet) < -0.5);
  }
}
