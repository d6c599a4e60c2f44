// Collisions of soft bodies with rigid bodies of every kind.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#include <set>

#include "plugin/support/obstacle_worlds.h"
#include "scene/obstacles.h"
#include "support/catch.h"
#include "util/warning_log.h"

using namespace lazyccd;
using namespace lazyccd::test;
using scenes::World;

namespace {

int count_below(const btSoftBody& body, double height) {
  int count = 0;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    count += static_cast<double>(body.m_nodes[i].m_x.y()) < height;
  }
  return count;
}

// Flat obstacles at height zero, 3 m wide, of every shape that has triangles.
struct Flat {
  std::unique_ptr<btTriangleMesh> mesh = flat_triangles(6, 3);
  std::vector<btScalar> heights = std::vector<btScalar>(49, btScalar(0));
  std::unique_ptr<btBvhTriangleMeshShape> unscaled;

  std::unique_ptr<btCollisionShape> make(const std::string& kind) {
    if (kind == "mesh") return std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true);
    if (kind == "scaled mesh") {
      mesh = flat_triangles(6, 1);
      unscaled = std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true);
      return std::make_unique<btScaledBvhTriangleMeshShape>(unscaled.get(), btVector3(3, 1, 3));
    }
    if (kind == "gimpact") {
      auto shape = std::make_unique<btGImpactMeshShape>(mesh.get());
      shape->updateBound();
      return shape;
    }
    if (kind == "heightfield") {
      auto shape = std::make_unique<btHeightfieldTerrainShape>(7, 7, heights.data(), btScalar(-1),
                                                               btScalar(1), 1, false);
      shape->setLocalScaling(btVector3(btScalar(0.5), 1, btScalar(0.5)));
      return shape;
    }
    if (kind == "plane") return std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), 0);
    auto compound = std::make_unique<btCompoundShape>();
    unscaled = std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true);
    compound->addChildShape(
        btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(-0.3), 0)), unscaled.get());
    return compound;
  }
};

}  // namespace

TEST_CASE("cloth stays above a thin mesh at any speed with every triangle shape") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string kind =
      GENERATE("mesh", "scaled mesh", "gimpact", "heightfield", "plane", "compound");
  const double speed = GENERATE(2.0, 30.0);
  CAPTURE(world == World::rigid, kind, speed);
  Flat flat;
  ObstacleWorld w(world, 10);
  w.add(flat.make(kind), btVector3(0, kind == "compound" ? btScalar(0.3) : 0, 0));
  btSoftBody* cloth = w.add_sheet(9, 1, 0.25, speed);
  w.steps(30, 1.0 / 60);
  CHECK(count_below(*cloth, -1e-4) == 0);
  CHECK(w.total().fallback_steps == 0);
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("a kinematic mesh pushes cloth along and never passes through it") {
  const World world = GENERATE(World::rigid, World::deformable);
  const double speed = GENERATE(1.0, 20.0);
  CAPTURE(world == World::rigid, speed);
  Flat flat;
  ObstacleWorld w(world, 0);
  btRigidBody* lift = w.add(flat.make("mesh"), btVector3(0, -1, 0));
  ObstacleWorld::make_kinematic(*lift);
  btSoftBody* cloth = w.add_sheet(9, 1, 0.2, 0);
  w.steps(60, 1.0 / 60, [&](int i) {
    const btScalar height = static_cast<btScalar>(-1 + speed * (i + 1) / 60);
    lift->setWorldTransform(
        btTransform(btQuaternion(btVector3(0, 1, 0), btScalar(0.02 * i)), btVector3(0, height, 0)));
  });
  const double height = static_cast<double>(lift->getWorldTransform().getOrigin().y());
  CHECK(height > -0.1);
  CHECK(count_below(*cloth, height) == 0);
  CHECK(w.total().failsafe_holds == 0);
}

TEST_CASE("cloth that is pushed far in one step collides with bodies there") {
  // The wall is ten cloth widths away. Only the ram comes near it.
  const World world = GENERATE(World::rigid, World::deformable);
  const bool kinematic = GENERATE(true, false);
  CAPTURE(world == World::rigid, kinematic);
  ObstacleWorld w(world, 0);
  w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.01), 1)), btVector3(0, -2, 0));
  btRigidBody* ram = w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.05), 1)),
                           btVector3(0, btScalar(0.2), 0), kinematic ? 0 : 1e3);
  btSoftBody* cloth = w.add_sheet(4, 0.2, 0, 0);
  if (kinematic) ObstacleWorld::make_kinematic(*ram);
  w.steps(1, 1.0 / 60);
  if (kinematic) {
    ram->setWorldTransform(btTransform(btQuaternion::getIdentity(), btVector3(0, -3, 0)));
  } else {
    ram->setLinearVelocity(btVector3(0, -180, 0));
  }
  w.steps(1, 1.0 / 60);
  for (int i = 0; i < cloth->m_nodes.size(); ++i) {
    CHECK(cloth->m_nodes[i].m_x.y() > btScalar(-2));
    // If the ram is kinematic, the cloth cannot move on; LazyCCD's surface of the ram waits.
    CHECK((kinematic || cloth->m_nodes[i].m_x.y() < btScalar(-0.5)));
  }
}

// Otherwise a step would read the same triangles again and again.
TEST_CASE("a wanted region is read although positions are rounded by the width of bodies") {
  constexpr btScalar width = btScalar(0.003), far = btScalar(1.8) * width / SIMD_EPSILON;
  std::mt19937 random(11);
  std::uniform_real_distribution<btScalar> part(-1, 1);
  const auto vector = [&] { return btVector3(part(random), part(random), part(random)); };
  const std::unique_ptr<btTriangleMesh> mesh = flat_triangles(6, width);
  for (int round = 0; round < 200; ++round) {
    CAPTURE(round);
    ObstacleWorld w(World::rigid, 0);
    const btVector3 place = far * btVector3(1, part(random), part(random));
    auto shape = std::make_unique<btGImpactMeshShape>(mesh.get());
    shape->updateBound();
    btRigidBody* body = w.add(std::move(shape), place, 1, 0.002 * width);
    btQuaternion rotation(part(random), part(random), part(random), part(random));
    body->setCenterOfMassTransform(btTransform(rotation.normalize(), place));
    btSoftBody* cloth = w.add_sheet(3, width, 0, 0);
    cloth->translate(place);
    w.world().updateAabbs();

    bullet::AxisBox swept = bullet::AxisBox::empty();
    for (int i = 0; i < 3; ++i) swept.add(place + width * vector());
    bullet::Obstacles obstacles(5);
    bullet::WarningLog warnings(nullptr);
    btAlignedObjectArray<btSoftBody*> bodies;
    bodies.push_back(cloth);
    obstacles.begin_step(bodies);
    obstacles.read_poses(bodies, 1, warnings);
    if (obstacles.update(bodies, {swept}, 1e-5, warnings))
      obstacles.read_triangles({swept}, warnings);
    CHECK(obstacles.records().size() == 1);
    CHECK(obstacles.has_read({swept}));
  }
}

TEST_CASE("cloth never passes through thin convex bodies") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string kind = GENERATE("box", "sphere", "capsule", "cylinder", "hull");
  CAPTURE(world == World::rigid, kind);
  ObstacleWorld w(world, 0);
  std::unique_ptr<btCollisionShape> shape;
  if (kind == "box") shape = std::make_unique<btBoxShape>(btVector3(1, btScalar(0.02), 1));
  if (kind == "sphere") shape = std::make_unique<btSphereShape>(btScalar(0.1));
  if (kind == "capsule") shape = std::make_unique<btCapsuleShapeX>(btScalar(0.05), 3);
  if (kind == "cylinder")
    shape = std::make_unique<btCylinderShapeX>(btVector3(2, btScalar(0.05), btScalar(0.05)));
  if (kind == "hull") {
    auto hull = std::make_unique<btConvexHullShape>();
    for (const double x : {-2.0, 2.0}) {
      for (const double z : {-0.05, 0.05}) {
        hull->addPoint(btVector3(static_cast<btScalar>(x), 0, static_cast<btScalar>(z)));
      }
      hull->addPoint(btVector3(static_cast<btScalar>(x), btScalar(0.04), 0));
    }
    shape = std::move(hull);
  }
  w.add(std::move(shape), btVector3(0, 0, 0));
  btSoftBody* cloth = w.add_sheet(9, 1, 0.25, 30);
  w.steps(12, 1.0 / 60);
  // The middle hangs on the obstacle, whatever the rest does.
  btScalar middle = -100;
  for (int i = 0; i < cloth->m_nodes.size(); ++i) {
    middle = btMax(middle, cloth->m_nodes[i].m_x.y());
  }
  CHECK(middle > btScalar(-0.1));
  CHECK(w.total().fallback_steps == 0);
}

TEST_CASE("rigid obstacles can be turned off and filters apply to them") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string by = GENERATE("option", "ignore", "flags");
  CAPTURE(world == World::rigid, by);
  bullet::SolverOptions options;
  options.collide_rigid = by != "option";
  Flat flat;
  ObstacleWorld w(world, 0, options);
  btRigidBody* floor = w.add(flat.make("mesh"), btVector3(0, 0, 0));
  btSoftBody* cloth = w.add_sheet(9, 1, 0.25, 30);
  if (by == "ignore") cloth->setIgnoreCollisionCheck(floor, true);
  if (by == "flags") cloth->m_cfg.collisions = btSoftBody::fCollision::VF_SS;
  w.steps(12, 1.0 / 60);
  CHECK(count_below(*cloth, 0) == 81);
  CHECK(w.total().contacts_vf == 0);
}

TEST_CASE("filters and flags of a rigid body apply from the next step on") {
  struct Filter : btOverlapFilterCallback {
    bool meets = true;
    std::set<const btBroadphaseProxy*> pair;
    bool needBroadphaseCollision(btBroadphaseProxy* a, btBroadphaseProxy* b) const override {
      return meets || std::set<const btBroadphaseProxy*>{a, b} != pair;
    }
  };
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string by = GENERATE("group", "mask", "ignore", "response", "filter");
  const bool ends_meeting = GENERATE(false, true);
  CAPTURE(world == World::rigid, by, ends_meeting);
  Filter filter;
  Flat flat;
  ObstacleWorld w(world, 0);
  btRigidBody* const floor = w.add(flat.make("mesh"), btVector3(0, 0, 0));
  btSoftBody* const cloth = w.add_sheet(5, 1, 0.2, 5);
  w.add_sheet(5, 1, 0.5, 0);  // has the same margin and may always collide with the floor
  filter.pair = {cloth->getBroadphaseHandle(), floor->getBroadphaseHandle()};
  btBroadphaseProxy& proxy = *floor->getBroadphaseHandle();
  const int group = proxy.m_collisionFilterGroup, mask = proxy.m_collisionFilterMask;
  const auto say = [&](bool meets) {
    if (by == "group") proxy.m_collisionFilterGroup = meets ? group : 0;
    if (by == "mask") proxy.m_collisionFilterMask = meets ? mask : 0;
    if (by == "ignore") floor->setIgnoreCollisionCheck(cloth, !meets);
    const int no_response = btCollisionObject::CF_NO_CONTACT_RESPONSE;
    const int flags = floor->getCollisionFlags();
    if (by == "response")
      floor->setCollisionFlags(meets ? flags & ~no_response : flags | no_response);
    filter.meets = meets;
  };
  if (by == "filter") w.world().getPairCache()->setOverlapFilterCallback(&filter);
  say(!ends_meeting);
  w.steps(4);
  REQUIRE(count_below(*cloth, 0.05) == 0);
  say(ends_meeting);
  w.steps(30);
  // Bullet's own contacts in the deformable world ignore the flag for no response.
  const bool is_bullets = by == "response" && world == World::deformable;
  CHECK(count_below(*cloth, 0) == (ends_meeting || is_bullets ? 0 : 25));
}

TEST_CASE("a static body that gets a mass is movable from the next step on") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  auto shape =
      std::make_unique<btBoxShape>(btVector3(btScalar(0.2), btScalar(0.05), btScalar(0.2)));
  btVector3 inertia;
  shape->calculateLocalInertia(1, inertia);
  btRigidBody* const box = w.add(std::move(shape), btVector3(0, btScalar(0.2), 0));
  btSoftBody* const sheet = w.add_sheet(5, 1, 0, 0);
  scenes::pin(*sheet, 0, sheet->m_nodes.size() - 1);
  const auto lift = [&](int) {
    for (int n = 0; n < sheet->m_nodes.size(); ++n) sheet->m_nodes[n].m_v = btVector3(0, 5, 0);
  };
  w.steps(4, 1.0 / 240, lift);
  box->setMassProps(1, inertia);
  w.steps(20, 1.0 / 240, lift);
  CHECK(box->getWorldTransform().getOrigin().y() > sheet->m_nodes[0].m_x.y());
}

namespace {

// Final positions of a cloth. Its first column is inside a box and anchored to it, and the box
// moves.
std::vector<btVector3> anchored_cloth(World world, bool obstacles) {
  bullet::SolverOptions options;
  options.collide_rigid = obstacles;
  ObstacleWorld w(world, 0, options);
  btRigidBody* box = w.add(std::make_unique<btBoxShape>(btVector3(btScalar(0.1), btScalar(0.1), 1)),
                           btVector3(0, 0, 0));
  ObstacleWorld::make_kinematic(*box);
  auto sheet = scenes::make_cloth(w.info(), 5, 5, 1, [](double u, double v) {
    return btVector3(static_cast<btScalar>(u), 0, static_cast<btScalar>(v - 0.5));
  });
  btSoftBody* cloth = w.add(std::move(sheet));
  for (int row = 0; row < 5; ++row) {
    if (world == World::rigid) {
      cloth->appendAnchor(5 * row, box);
    } else {
      cloth->appendDeformableAnchor(5 * row, box);
    }
  }
  w.steps(10, 1.0 / 60, [&](int i) {
    box->setWorldTransform(
        btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(0.05 * (i + 1)), 0)));
  });
  std::vector<btVector3> positions;
  for (int i = 0; i < cloth->m_nodes.size(); ++i) positions.push_back(cloth->m_nodes[i].m_x);
  return positions;
}

}  // namespace

TEST_CASE("an anchored node does not collide with the body of its anchor") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::vector<btVector3> with = anchored_cloth(world, true);
  const std::vector<btVector3> without = anchored_cloth(world, false);
  CHECK(with[0].y() > btScalar(0.4));
  for (std::size_t i = 0; i < with.size(); ++i) {
    CHECK((with[i] - without[i]).length() < btScalar(1e-5));
  }
}

TEST_CASE("obstacles are dropped with the last soft body that collides with them") {
  const World world = GENERATE(World::rigid, World::deformable);
  const bool goes = GENERATE(true, false);  // false: stops colliding with rigid bodies
  CAPTURE(world == World::rigid, goes);
  ObstacleWorld w(world, 10);
  w.add(std::make_unique<btSphereShape>(btScalar(0.2)), btVector3(0, 0, 0));
  btSoftBody* falls = w.add_sheet(5, 1, 0.3, 0);
  btSoftBody* hangs = w.add_sheet(5, 1, 1, 0);
  hangs->m_cfg.collisions = btSoftBody::fCollision::VF_SS | btSoftBody::fCollision::VF_DD;
  w.steps(2);
  if (goes) {
    w.remove(falls);
  } else {
    falls->m_cfg.collisions = hangs->m_cfg.collisions;
  }
  w.steps(2);
  CHECK(w.total().fallback_steps == 0);
}

TEST_CASE("an obstacle is read again if an application changes its shape") {
  const World world = GENERATE(World::rigid, World::deformable);
  const std::string child = GENERATE("moves", "moves inside of the bounds", "grows", "comes");
  CAPTURE(world == World::rigid, child);
  ObstacleWorld w(world, 0);
  btSphereShape ball(btScalar(0.2)), beside(btScalar(0.1)), below(btScalar(0.3));
  auto compound = std::make_unique<btCompoundShape>();
  const auto at = [](double x, double y) {
    return btTransform(btQuaternion::getIdentity(),
                       btVector3(static_cast<btScalar>(x), static_cast<btScalar>(y), 0));
  };
  const bool moves = child.find("moves") == 0;
  if (child != "comes") compound->addChildShape(at(0, moves ? -3 : -1), &ball);
  // Makes LazyCCD read the whole compound where the sheet starts.
  compound->addChildShape(at(1, 0.5), &beside);
  // The new child will leave the bounds unchanged.
  if (child == "comes" || child == "moves inside of the bounds")
    compound->addChildShape(at(-1, -3), &below);
  btCompoundShape* shape = compound.get();
  w.add(std::move(compound), btVector3(0, 0, 0));
  btSoftBody* sheet = w.add_sheet(8, 1, 0.5, 5);
  w.steps(6);
  if (moves) {
    shape->updateChildTransform(0, at(0, -1));
  } else if (child == "grows") {
    ball.setUnscaledRadius(btScalar(0.4));
    shape->recalculateLocalAabb();
  } else {
    shape->addChildShape(at(0, -1), &ball);
  }
  w.steps(120);
  const double radius = child == "grows" ? 0.4 : 0.2;
  double nearest = 10;
  for (int i = 0; i < sheet->m_nodes.size(); ++i)
    nearest = std::min<double>(nearest, (sheet->m_nodes[i].m_x - btVector3(0, -1, 0)).length());
  CHECK(w.total().contacts_vf > 0);
  CHECK(nearest > radius);
}

TEST_CASE("a body that an application has disabled stays where it is") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  btRigidBody* box =
      w.add(std::make_unique<btBoxShape>(btVector3(btScalar(0.2), btScalar(0.2), btScalar(0.2))),
            btVector3(0, 0, 0), 0.1);
  box->forceActivationState(DISABLE_SIMULATION);
  const btTransform pose = box->getWorldTransform();
  w.add_sheet(7, 1, 0.25, 2);
  w.steps(30);
  CHECK(w.total().contacts_vf > 0);
  CHECK(box->getWorldTransform() == pose);
  CHECK(box->getLinearVelocity().length() == 0);
}

TEST_CASE("an obstacle is read again if an application mirrors it") {
  const World world = GENERATE(World::rigid, World::deformable);
  CAPTURE(world == World::rigid);
  ObstacleWorld w(world, 0);
  // A right-angled prism on one side of its longest face, x + z = 0. Its mirror image has the same
  // bounds.
  auto prism = std::make_unique<btConvexHullShape>();
  for (const auto& [x, z] : {std::pair{-1, -1}, {1, -1}, {-1, 1}})
    for (const double y : {0.2, 0.35})
      prism->addPoint(btVector3(btScalar(x), static_cast<btScalar>(y), btScalar(z)), true);
  btConvexHullShape* const shape = prism.get();
  w.add(std::move(prism), btVector3(0, 0, 0));
  shape->recalcLocalAabb();  // with the margin that it now has
  btSoftBody* const sheet = w.add_sheet(5, 0.5, 0.5, 2);
  sheet->translate(btVector3(btScalar(0.6), 0, btScalar(0.6)));
  w.steps(6);
  shape->setLocalScaling(btVector3(-1, 1, -1));
  w.steps(60);
  CHECK(count_below(*sheet, 0.35) == 0);
}

TEST_CASE("a step without bodies near each other runs no detection") {
  const World world = GENERATE(World::rigid, World::deformable);
  ObstacleWorld w(world, 0);
  w.add(std::make_unique<btBoxShape>(btVector3(1, btScalar(0.1), 1)), btVector3(0, 0, 0));
  btSoftBody* const cloth = w.add_sheet(4, 1, 0.5, 10);
  btSoftBody* const other = w.add_sheet(4, 1, 2, 0);
  bool searched = false;
  w.steps(24, 1.0 / 240, [&](int) {
    const bool is_near = w.contacts().size() > 0;
    CHECK((w.last().detections > 0 || !is_near));
    searched = searched || w.last().detections > 0;
    // The cloth needs nine steps down to the box.
    if (cloth->m_nodes[0].m_x.y() > btScalar(0.2)) CHECK_FALSE(searched);
  });
  CHECK(searched);
  CHECK(count_below(*cloth, 0.1) == 0);
  // A body with self-collision can always collide.
  w.remove(cloth);
  w.steps(2);
  CHECK(w.last().detections == 0);
  other->setSelfCollision(true);
  w.steps(1);
  CHECK(w.last().detections > 0);
}

TEST_CASE("bodies apart along a single axis are near exactly up to their margins") {
  const World world = GENERATE(World::rigid, World::deformable);
  const int axis = GENERATE(0, 1, 2);
  const double apart = GENERATE(0.019, 0.03);
  CAPTURE(world == World::rigid, axis, apart);
  ObstacleWorld w(world, 0);
  // Two parallel triangles with a gap between them.
  for (const double at : {0.0, apart}) {
    btVector3 corners[3] = {btVector3(0, 0, 0), btVector3(0, 0, 0), btVector3(0, 0, 0)};
    corners[1][(axis + 1) % 3] = corners[2][(axis + 2) % 3] = 1;
    for (btVector3& x : corners) x[axis] = static_cast<btScalar>(at);
    auto body = std::make_unique<btSoftBody>(&w.info(), 3, corners, nullptr);
    body->appendFace(0, 1, 2);
    w.add(std::move(body));
  }
  w.steps(1);
  CHECK((w.last().detections > 0) == (apart < 0.02));
}

TEST_CASE("if soft bodies move only obstacles read in part are read again") {
  ObstacleWorld w(World::rigid, 0);
  const auto mesh = flat_triangles(20, 20);
  w.add(std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true), btVector3(0, 0, 0));
  w.add(std::make_unique<btCapsuleShapeX>(btScalar(0.3), 20), btVector3(0, 1, 0));
  btSoftBody* const sheet = w.add_sheet(3, 1, 0.5, 0);
  btAlignedObjectArray<btSoftBody*> bodies;
  bodies.push_back(sheet);
  bullet::WarningLog warnings({});
  bullet::Obstacles obstacles(5);
  const auto read_at = [&](double x, double depth) {
    const btVector3 middle(static_cast<btScalar>(x), 0, 0), half(1, 1, 1);
    obstacles.begin_step(bodies);
    const bullet::AxisBox box = {middle - half, middle + half};
    obstacles.read_poses(bodies, 1, warnings);
    const bool changed = obstacles.update(bodies, {box}, depth, warnings);
    if (changed) obstacles.read_triangles({box}, warnings);
    REQUIRE(obstacles.records().size() == 2);
    return changed;
  };
  const auto triangles = [&](std::size_t i) { return obstacles.records()[i].triangles; };
  CHECK(read_at(0, 0.005));
  CHECK_FALSE(read_at(0.1, 0.005));
  const auto terrain = triangles(0), capsule = triangles(1);
  CHECK(read_at(4, 0.005));
  CHECK(triangles(0) != terrain);
  CHECK(triangles(1) == capsule);
  CHECK(obstacles.vertex_count() ==
        static_cast<std::int32_t>(triangles(0)->vertices.size() + capsule->vertices.size()));
  // Finer for a smaller depth.
  CHECK(read_at(4, 0.002));
  CHECK(triangles(1)->faces.size() > capsule->faces.size());
}
