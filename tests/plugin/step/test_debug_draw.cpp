#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <LinearMath/btIDebugDraw.h>

#include <algorithm>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

// Keeps what is drawn.
class Drawing : public btIDebugDraw {
 public:
  struct Line {
    btVector3 from, to, colour;
    btVector3 along() const { return to - from; }
  };
  std::vector<Line> lines, boxes;  // of a box: its two corners

  void drawLine(const btVector3& from, const btVector3& to, const btVector3& colour) override {
    lines.push_back({from, to, colour});
  }
  void drawAabb(const btVector3& from, const btVector3& to, const btVector3& colour) override {
    boxes.push_back({from, to, colour});
  }
  void drawContactPoint(const btVector3&, const btVector3&, btScalar, int,
                        const btVector3&) override {}
  void reportErrorWarning(const char*) override {}
  void draw3dText(const btVector3&, const char*) override {}
  void setDebugMode(int) override {}
  int getDebugMode() const override { return DBG_NoDebug; }
};

bullet::DebugDrawOptions only(bool bullet::DebugDrawOptions::*part) {
  bullet::DebugDrawOptions options;
  options.contacts = options.impulses = options.islands = options.zones = options.holds = false;
  options.*part = true;
  return options;
}

Drawing draw(const ObstacleWorld& w, const bullet::DebugDrawOptions& options) {
  Drawing drawing;
  w.debug_draw(drawing, options);
  return drawing;
}

btVector3 impulse_of(const bullet::StepContact& contact) {
  return static_cast<btScalar>(contact.impulse) * contact.normal + contact.friction_impulse;
}

void add_ground(ObstacleWorld& w) {
  w.add(std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), btVector3(0, 0, 0));
}

// A sheet flies at another one, which is pinned at its border.
struct FlyingSheet {
  explicit FlyingSheet(ObstacleWorld& w)
      : target(w.add_sheet(9, 2, 0, 0)), thrown(w.add_sheet(6, 1, 0.1, 30)) {
    scenes::pin_border(*target, 9, 9);
  }
  btSoftBody *target, *thrown;
};

std::vector<btVector3> positions_of(const btSoftBody& body) {
  std::vector<btVector3> positions;
  for (int i = 0; i < body.m_nodes.size(); ++i) positions.push_back(body.m_nodes[i].m_x);
  return positions;
}

// The middles of crosses, of which each is three lines.
std::vector<btVector3> crosses_in(const Drawing& drawing) {
  std::vector<btVector3> middles;
  REQUIRE(drawing.lines.size() % 3 == 0);
  for (std::size_t i = 0; i < drawing.lines.size(); i += 3)
    middles.push_back(drawing.lines[i].from.lerp(drawing.lines[i].to, btScalar(0.5)));
  return middles;
}

bool is_among(const btVector3& x, const std::vector<btVector3>& points) {
  return std::any_of(points.begin(), points.end(),
                     [&x](const btVector3& point) { return point.distance(x) < btScalar(1e-5); });
}

}  // namespace

TEST_CASE("each contact is drawn once, from its point along its normal") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  add_ground(w);
  w.add_sheet(6, 1, 0.05, 2);
  while (w.contacts().empty()) w.steps(1);

  bullet::DebugDrawOptions options = only(&bullet::DebugDrawOptions::contacts);
  options.normal_length = 0.3;
  const Drawing drawing = draw(w, options);
  CHECK(drawing.boxes.empty());
  REQUIRE(drawing.lines.size() == w.contacts().size());
  for (std::size_t i = 0; i < drawing.lines.size(); ++i) {
    CHECK(drawing.lines[i].from == w.contacts()[i].point);
    CHECK((drawing.lines[i].along() - btScalar(0.3) * w.contacts()[i].normal).length() <
          btScalar(1e-5));
  }
}

TEST_CASE("impulses are drawn in proportion to the largest of their island") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 10);
  add_ground(w);
  btSoftBody* const sheet = w.add_sheet(6, 1, 0.05, 2);
  sheet->setVelocity(btVector3(1, -2, 0));
  while (w.contacts().empty()) w.steps(1);

  btScalar largest = 0;
  std::vector<btVector3> impulses;
  for (const bullet::StepContact& contact : w.contacts())
    if (!impulse_of(contact).isZero()) impulses.push_back(impulse_of(contact));
  for (const btVector3& impulse : impulses) largest = std::max(largest, impulse.length());
  bullet::DebugDrawOptions options = only(&bullet::DebugDrawOptions::impulses);
  options.impulse_length = 0.4;
  const Drawing drawing = draw(w, options);
  REQUIRE(largest > 0);
  REQUIRE(drawing.lines.size() == impulses.size());
  for (std::size_t i = 0; i < impulses.size(); ++i)
    CHECK((drawing.lines[i].along() - btScalar(0.4) / largest * impulses[i]).length() <
          btScalar(1e-5));
}

TEST_CASE("islands are drawn in colours of their own, around their bodies") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool apart = GENERATE(false, true);
  CAPTURE(world == World::rigid, apart);
  ObstacleWorld w(world, 10);
  add_ground(w);
  btSoftBody* const first = w.add_sheet(6, 1, 0.03, 1);
  btSoftBody* const second = w.add_sheet(6, 1, apart ? 0.03 : 0.06, 1);
  second->translate(btVector3(apart ? 3 : btScalar(0.1), 0, 0));
  const std::size_t islands = apart ? 2 : 1;
  const auto touches = [&w](const btSoftBody* body) {
    return std::any_of(w.contacts().begin(), w.contacts().end(), [&](const auto& contact) {
      return contact.body_a == body || contact.body_b == body;
    });
  };
  for (int i = 0; i < 100 && !(touches(first) && touches(second)); ++i) w.steps(1);
  REQUIRE(w.last().islands == static_cast<std::int64_t>(islands));

  const Drawing boxes = draw(w, only(&bullet::DebugDrawOptions::islands));
  CHECK(boxes.lines.empty());
  REQUIRE(boxes.boxes.size() == islands);
  CHECK((boxes.boxes.front().colour == boxes.boxes.back().colour) == !apart);
  const Drawing contacts = draw(w, only(&bullet::DebugDrawOptions::contacts));
  REQUIRE(contacts.lines.size() == w.contacts().size());
  for (const Drawing::Line& box : boxes.boxes) {
    for (std::size_t i = 0; i < contacts.lines.size(); ++i) {
      const btVector3 at = contacts.lines[i].from;
      const bool is_inside =
          at.x() > box.from.x() - btScalar(0.1) && at.x() < box.to.x() + btScalar(0.1);
      CHECK((contacts.lines[i].colour == box.colour) == is_inside);
    }
  }
  for (const btSoftBody* const body : {first, second}) {
    for (const btVector3& x : positions_of(*body)) {
      CHECK(std::any_of(boxes.boxes.begin(), boxes.boxes.end(), [&x](const Drawing::Line& box) {
        btVector3 low = box.from, high = box.to;
        low.setMin(x);
        high.setMax(x);
        return low == box.from && high == box.to;
      }));
    }
  }
}

TEST_CASE("nothing is drawn without contacts") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  add_ground(w);
  w.add_sheet(6, 1, 1, 0);
  for (int step = 0; step < 2; ++step) {
    const Drawing drawing = draw(w, {});
    CHECK(drawing.lines.empty());
    CHECK(drawing.boxes.empty());
    w.steps(1);
  }
}

TEST_CASE("impact zones are drawn around their nodes") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  bullet::SolverOptions options;
  options.max_impulse_rounds = 0;
  ObstacleWorld w(world, 0, options);
  const FlyingSheet impact(w);
  for (int i = 0; i < 6 && w.last().impact_zone_nodes == 0; ++i) w.steps(1, 1.0 / 60);
  REQUIRE(w.last().impact_zone_nodes > 0);
  REQUIRE(w.last().failsafe_holds == 0);

  const Drawing drawing = draw(w, only(&bullet::DebugDrawOptions::zones));
  REQUIRE(!drawing.boxes.empty());
  const std::vector<btVector3> nodes = crosses_in(drawing);
  CHECK(nodes.size() == static_cast<std::size_t>(w.last().impact_zone_nodes));
  for (const btVector3& x : nodes) {
    CHECK(std::any_of(drawing.boxes.begin(), drawing.boxes.end(), [&x](const Drawing::Line& box) {
      const btVector3 slack(btScalar(1e-5), btScalar(1e-5), btScalar(1e-5));
      btVector3 low = box.from - slack, high = box.to + slack;
      low.setMin(x);
      high.setMax(x);
      return low == box.from - slack && high == box.to + slack;
    }));
  }
  CHECK(draw(w, only(&bullet::DebugDrawOptions::holds)).lines.empty());
  w.remove(impact.thrown);  // nothing of it is read
  CHECK(draw(w, only(&bullet::DebugDrawOptions::zones)).lines.size() == drawing.lines.size());
  w.steps(1);
  REQUIRE(w.last().impact_zone_nodes == 0);
  CHECK(draw(w, only(&bullet::DebugDrawOptions::zones)).lines.empty());
  CHECK(draw(w, only(&bullet::DebugDrawOptions::zones)).boxes.empty());
}

TEST_CASE("nodes that the fail-safe holds are drawn where they were") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  bullet::SolverOptions options;
  options.max_impulse_rounds = options.max_zone_rounds = 0;
  ObstacleWorld w(world, 0, options);
  const FlyingSheet impact(w);
  std::vector<btVector3> before;
  for (int i = 0; i < 6 && w.last().failsafe_holds == 0; ++i) {
    before = positions_of(*impact.target);
    for (const btVector3& x : positions_of(*impact.thrown)) before.push_back(x);
    w.steps(1, 1.0 / 60);
  }
  REQUIRE(w.last().failsafe_holds > 0);

  const std::vector<btVector3> held = crosses_in(draw(w, only(&bullet::DebugDrawOptions::holds)));
  CHECK(held.size() >= static_cast<std::size_t>(w.last().failsafe_holds));
  for (const btVector3& x : held) CHECK(is_among(x, before));
  const Drawing zones = draw(w, only(&bullet::DebugDrawOptions::zones));
  CHECK(zones.lines.empty());  // their nodes are held
  CHECK(!zones.boxes.empty());
}

TEST_CASE("a body that the fail-safe holds is drawn as a box") {
  // A sheet between a plate that nothing moves and one that comes nearer.
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  w.add_sheet(6, 1, 0, 0);
  const btVector3 half(1, btScalar(0.1), 1);
  w.add(std::make_unique<btBoxShape>(half), btVector3(0, btScalar(-0.13), 0));
  btRigidBody* const plate =
      w.add(std::make_unique<btBoxShape>(half), btVector3(0, btScalar(0.2), 0));
  ObstacleWorld::make_kinematic(*plate);
  const auto come_nearer = [plate](int) {
    btTransform pose = plate->getWorldTransform();
    pose.getOrigin() -= btVector3(0, btScalar(0.02), 0);
    plate->setWorldTransform(pose);
  };
  Drawing drawing;
  for (int i = 0; i < 12 && drawing.boxes.empty(); ++i) {
    w.steps(1, 1.0 / 60, come_nearer);
    drawing = draw(w, only(&bullet::DebugDrawOptions::holds));
  }
  REQUIRE(drawing.boxes.size() == 1);
  CHECK(w.last().failsafe_holds > 0);
  CHECK(drawing.boxes[0].from.y() > btScalar(-0.05));
  CHECK(drawing.boxes[0].to.x() - drawing.boxes[0].from.x() > btScalar(1.9));
}
