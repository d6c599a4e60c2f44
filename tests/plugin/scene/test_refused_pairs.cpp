#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <string>
#include <vector>

#include "plugin/support/obstacle_worlds.h"
#include "plugin/support/worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

constexpr int marked = 7;  // user index of bodies that ignore each other

bool ignore_each_other(const btCollisionObject& a, const btCollisionObject& b) {
  return a.getUserIndex() == marked && b.getUserIndex() == marked;
}

void refuse_marked(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                   const btDispatcherInfo& info) {
  const auto object = [](const btBroadphaseProxy* proxy) -> const btCollisionObject& {
    return *static_cast<const btCollisionObject*>(proxy->m_clientObject);
  };
  if (ignore_each_other(object(pair.m_pProxy0), object(pair.m_pProxy1))) return;
  btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}

btCollisionDispatcher& dispatcher_of(btCollisionWorld& world) {
  return static_cast<btCollisionDispatcher&>(*world.getDispatcher());
}

double highest(const btSoftBody& body) {
  double y = -1e9;
  for (int i = 0; i < body.m_nodes.size(); ++i)
    y = std::max(y, static_cast<double>(body.m_nodes[i].m_x.y()));
  return y;
}

double lowest(const btSoftBody& body) {
  double y = 1e9;
  for (int i = 0; i < body.m_nodes.size(); ++i)
    y = std::min(y, static_cast<double>(body.m_nodes[i].m_x.y()));
  return y;
}

std::unique_ptr<btCollisionShape> box(double width, double height) {
  return std::make_unique<btBoxShape>(btVector3(static_cast<btScalar>(width / 2),
                                                static_cast<btScalar>(height / 2),
                                                static_cast<btScalar>(width / 2)));
}

// An algorithm that does nothing.
struct OwnAlgorithm : btCollisionAlgorithm {
  using btCollisionAlgorithm::btCollisionAlgorithm;
  void processCollision(const btCollisionObjectWrapper*, const btCollisionObjectWrapper*,
                        const btDispatcherInfo&, btManifoldResult*) override {}
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray&) override {}

  struct Create : btCollisionAlgorithmCreateFunc {
    btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                   const btCollisionObjectWrapper*,
                                                   const btCollisionObjectWrapper*) override {
      void* const memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(OwnAlgorithm));
      return new (memory) OwnAlgorithm(info);
    }
  };
};

struct OwnDispatcher : btCollisionDispatcher {
  using btCollisionDispatcher::btCollisionDispatcher;
  bool needsCollision(const btCollisionObject* a, const btCollisionObject* b) override {
    return !ignore_each_other(*a, *b) && btCollisionDispatcher::needsCollision(a, b);
  }
};

struct OwnSolver : bullet::btLazySoftBodySolver {
  using bullet::btLazySoftBodySolver::processCollision;
  void processCollision(btSoftBody* body, const btCollisionObjectWrapper* other) override {
    if (!ignore_each_other(*body, *other->getCollisionObject()))
      bullet::btLazySoftBodySolver::processCollision(body, other);
  }
};

// Cloth above a box on a ground; both are marked.
struct ClothOnBox {
  ObstacleWorld world;
  btSoftBody* cloth;

  explicit ClothOnBox(World kind) : world(kind, 10) {
    world.add(box(6, 1), btVector3(0, btScalar(-0.5), 0));
    world.add(box(0.8, 0.4), btVector3(0, btScalar(0.2), 0))->setUserIndex(marked);
    cloth = world.add_sheet(9, 1, 0.5, 0);
    cloth->setUserIndex(marked);
  }
  bool lies_on_box() const { return highest(*cloth) > 0.35; }
  bool lies_on_ground() const { return highest(*cloth) < 0.1 && lowest(*cloth) > 0; }
};

}  // namespace

TEST_CASE("a near callback keeps cloth and box apart") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const bool refuses = GENERATE(false, true);
  CAPTURE(kind == World::rigid, refuses);
  ClothOnBox scene(kind);
  if (refuses) dispatcher_of(scene.world.world()).setNearCallback(refuse_marked);
  scene.world.steps(180);
  CHECK(scene.lies_on_box() == !refuses);
  CHECK(scene.lies_on_ground() == refuses);
}

TEST_CASE("a near callback decides about two soft bodies at any time") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const std::string from = GENERATE("the callback", "its answer");
  CAPTURE(kind == World::rigid, from);
  ObstacleWorld w(kind, 0);
  btSoftBody* const held = w.add_sheet(9, 2, 0, 0);
  scenes::pin_border(*held, 9, 9);
  btSoftBody* const thrown = w.add_sheet(6, 1, 0.1, 10);
  btCollisionDispatcher& dispatcher = dispatcher_of(w.world());
  if (from == "its answer") dispatcher.setNearCallback(refuse_marked);
  w.steps(8);
  REQUIRE(w.total().contacts_vf > 0);
  REQUIRE(scenes::nodes_below(*thrown, 0, 35, *held) == 0);
  if (from == "the callback") dispatcher.setNearCallback(refuse_marked);
  held->setUserIndex(marked);
  thrown->setUserIndex(marked);
  throw_down(*thrown, 10);
  w.steps(24);
  CHECK(scenes::nodes_below(*thrown, 0, 35, *held) == 36);
}

TEST_CASE("an application's own algorithm keeps a soft body and a ball apart") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const bool has_own = GENERATE(false, true);
  CAPTURE(kind == World::rigid, has_own);
  OwnAlgorithm::Create create;
  ObstacleWorld w(kind, 10);
  w.add(box(6, 1), btVector3(0, btScalar(-0.5), 0));
  w.add(std::make_unique<btSphereShape>(btScalar(0.3)), btVector3(0, btScalar(0.3), 0));
  if (has_own) {
    btCollisionDispatcher& dispatcher = dispatcher_of(w.world());
    dispatcher.registerCollisionCreateFunc(SOFTBODY_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE,
                                           &create);
    dispatcher.registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, SOFTBODY_SHAPE_PROXYTYPE,
                                           &create);
  }
  const btSoftBody* const cloth = w.add_sheet(9, 1, 0.7, 0);
  w.steps(180);
  CHECK((highest(*cloth) > 0.55) == !has_own);
  CHECK((highest(*cloth) < 0.1) == has_own);
  CHECK(lowest(*cloth) > 0);
}

TEST_CASE("needsCollision() and processCollision() of an application keep cloth and box apart") {
  const std::string own = GENERATE("neither", "dispatcher", "solver");
  CAPTURE(own);
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher bullets(&configuration);
  OwnDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver constraints;
  bullet::btLazySoftBodySolver lazy;
  OwnSolver solver;
  btSoftRigidDynamicsWorld world(own == "dispatcher" ? &dispatcher : &bullets, &broadphase,
                                 &constraints, &configuration, own == "solver" ? &solver : &lazy);
  world.getWorldInfo().m_gravity = btVector3(0, -10, 0);
  const auto ground_shape = box(6, 1), box_shape = box(0.8, 0.4);
  btRigidBody ground(0, nullptr, ground_shape.get()), obstacle(0, nullptr, box_shape.get());
  ground.setWorldTransform(
      btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(-0.5), 0)));
  obstacle.setWorldTransform(
      btTransform(btQuaternion::getIdentity(), btVector3(0, btScalar(0.2), 0)));
  obstacle.setUserIndex(marked);
  world.addRigidBody(&ground);
  world.addRigidBody(&obstacle);
  std::mt19937 random(7);
  scenes::Sheet sheet{9, 9, 1, 1};
  sheet.height = 0.5;
  const std::unique_ptr<btSoftBody> cloth = scenes::make_sheet(world.getWorldInfo(), sheet, random);
  cloth->getCollisionShape()->setMargin(btScalar(0.01));
  cloth->m_cfg.collisions = btSoftBody::fCollision::SDF_RS;
  cloth->setUserIndex(marked);
  world.addSoftBody(cloth.get());
  for (int i = 0; i < 180; ++i) world.stepSimulation(btScalar(1) / 240, 0);
  CHECK((highest(*cloth) > 0.35) == (own == "neither"));
  CHECK((highest(*cloth) < 0.1) == (own != "neither"));
  CHECK(lowest(*cloth) > 0);
  world.removeSoftBody(cloth.get());
  world.removeRigidBody(&obstacle);
  world.removeRigidBody(&ground);
}

TEST_CASE("a near callback that refuses nothing changes nothing") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const std::string shape = GENERATE("box", "mesh", "plane", "compound");
  CAPTURE(kind == World::rigid, shape);
  const auto positions = [&](bool has_callback) {
    const std::unique_ptr<btTriangleMesh> mesh = flat_triangles(6, 3);
    const std::unique_ptr<btCollisionShape> child = box(3, 0.1);
    ObstacleWorld w(kind, 10);
    if (has_callback) dispatcher_of(w.world()).setNearCallback(refuse_marked);
    auto compound = std::make_unique<btCompoundShape>();
    compound->addChildShape(btTransform::getIdentity(), child.get());
    if (shape == "box") w.add(box(3, 0.1), btVector3(0, 0, 0));
    if (shape == "mesh")
      w.add(std::make_unique<btBvhTriangleMeshShape>(mesh.get(), true), btVector3(0, 0, 0));
    if (shape == "plane")
      w.add(std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), {0, 0, 0});
    if (shape == "compound") w.add(std::move(compound), btVector3(0, 0, 0));
    const btSoftBody* const fast = w.add_sheet(7, 1, 3.3, 200);
    w.add_sheet(7, 1, 0.3, 0);
    w.steps(60);
    std::vector<btScalar> y;
    for (int i = 0; i < fast->m_nodes.size(); ++i) y.push_back(fast->m_nodes[i].m_x.y());
    CHECK(lowest(*fast) > 0);
    return y;
  };
  CHECK(positions(true) == positions(false));
}

TEST_CASE("a refused pair stays refused, and others stay as they are, while they sleep") {
  const World kind = GENERATE(World::rigid, World::deformable);
  const bool refuses = GENERATE(false, true);
  CAPTURE(kind == World::rigid, refuses);
  ClothOnBox scene(kind);
  dispatcher_of(scene.world.world()).setNearCallback(refuse_marked);
  if (!refuses) scene.cloth->setUserIndex(0);
  scene.world.steps(180);
  for (int i = 0; i < 3; ++i) {
    scene.cloth->forceActivationState(ISLAND_SLEEPING);
    scene.world.steps(10);
    scene.cloth->forceActivationState(DISABLE_DEACTIVATION);
    scene.world.steps(10);
    CHECK(scene.lies_on_box() == !refuses);
    CHECK(scene.lies_on_ground() == refuses);
  }
}
