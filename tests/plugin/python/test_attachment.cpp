// Worlds that get LazyCCD's solver while they live, and then Bullet's own again.
#include "python/pybullet/attachment.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>

#include <set>

#include "support/catch.h"

using namespace lazyccd;
using pybullet::Attachment;
using Flag = btSoftBody::fCollision;

namespace {

bullet::SolverOptions one_thread() {
  bullet::SolverOptions options;
  options.detector.threads = 1;
  return options;
}

// A world as PyBullet makes it, with Bullet's own solver.
class StockWorld {
 public:
  explicit StockWorld(bool is_deformable) {
    if (is_deformable) {
      constraints_.setDeformableSolver(&solver_);
      auto world = std::make_unique<btDeformableMultiBodyDynamicsWorld>(
          &dispatcher_, &broadphase_, &constraints_, &configuration_, &solver_);
      info_ = &world->getWorldInfo();
      deformable_ = world.get();
      world_ = std::move(world);
    } else {
      auto world = std::make_unique<btSoftMultiBodyDynamicsWorld>(&dispatcher_, &broadphase_,
                                                                  &multibodies_, &configuration_);
      info_ = &world->getWorldInfo();
      info_->m_dispatcher = &dispatcher_;
      info_->m_broadphase = &broadphase_;
      info_->m_sparsesdf.Initialize();
      soft_ = world.get();
      world_ = std::move(world);
    }
    world_->setGravity(weight_);
    info_->m_gravity = weight_;
  }
  ~StockWorld() {
    for (const auto& body : soft_bodies_) world_->removeCollisionObject(body.get());
    if (ball_) world_->removeRigidBody(ball_.get());
  }

  btDiscreteDynamicsWorld& world() { return *world_; }
  btSoftBodyWorldInfo& info() { return *info_; }

  btSoftBody* add(btSoftBody* made) {
    soft_bodies_.emplace_back(made);
    made->setTotalMass(1);
    made->getCollisionShape()->setMargin(btScalar(0.03));
    made->setActivationState(DISABLE_DEACTIVATION);
    if (soft_) {
      made->m_cfg.piterations = 20;
      made->m_cfg.collisions |= Flag::VF_SS;
      soft_->addSoftBody(made);
      return made;
    }
    made->m_cfg.collisions = Flag::SDF_RD | Flag::SDF_RDF | Flag::VF_DD;
    made->m_cfg.kDF = btScalar(0.5);
    deformable_->addSoftBody(made);
    deformable_->addForce(made, &springs_);
    deformable_->addForce(made, &gravity_);
    return made;
  }
  // A square cloth in the plane y = `height`, 2 `half` wide, about x = `x`.
  btSoftBody* add_cloth(double x, double height, double half, int nodes, bool is_pinned) {
    const auto corner = [&](double u, double v) {
      return btVector3(static_cast<btScalar>(x + u * half), static_cast<btScalar>(height),
                       static_cast<btScalar>(v * half));
    };
    constexpr int all_corners = 15;
    return add(btSoftBodyHelpers::CreatePatch(*info_, corner(-1, -1), corner(1, -1), corner(-1, 1),
                                              corner(1, 1), nodes, nodes,
                                              is_pinned ? all_corners : 0, true));
  }
  const btRigidBody& add_ball(const btVector3& at) {
    btVector3 inertia;
    round_.calculateLocalInertia(btScalar(0.2), inertia);
    ball_ = std::make_unique<btRigidBody>(btScalar(0.2), nullptr, &round_, inertia);
    ball_->setWorldTransform(btTransform(btQuaternion::getIdentity(), at));
    world_->addRigidBody(ball_.get());
    return *ball_;
  }

  // Returns the number of Bullet's soft contacts, summed over the steps.
  int steps(int count) {
    int contacts = 0;
    for (int i = 0; i < count; ++i) {
      world_->stepSimulation(btScalar(1) / 240, 0);
      for (const auto& body : soft_bodies_)
        contacts += body->m_scontacts.size() + body->m_faceNodeContacts.size();
    }
    return contacts;
  }

 private:
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btMultiBodyConstraintSolver multibodies_;
  btDeformableMultiBodyConstraintSolver constraints_;
  btDeformableBodySolver solver_;
  const btVector3 weight_{0, btScalar(-9.81), 0};
  btDeformableMassSpringForce springs_{100, 1, true};
  btDeformableGravityForce gravity_{weight_};
  btSphereShape round_{btScalar(0.15)};
  std::unique_ptr<btRigidBody> ball_;
  btSoftBodyWorldInfo* info_ = nullptr;
  btDeformableMultiBodyDynamicsWorld* deformable_ = nullptr;
  btSoftMultiBodyDynamicsWorld* soft_ = nullptr;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
  std::vector<std::unique_ptr<btSoftBody>> soft_bodies_;
};

bool holds(const btDbvtVolume& volume, const btVector3& point) {
  return volume.Contain(btDbvtVolume::FromMM(point, point));
}

// Whether all nodes and faces are where both trees have them.
bool has_current_trees(const btSoftBody& body) {
  if (!body.m_fdbvt.m_root || !body.m_ndbvt.m_root) return false;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    const btSoftBody::Node& node = body.m_nodes[i];
    if (!holds(node.m_leaf->volume, node.m_x) || !holds(body.m_ndbvt.m_root->volume, node.m_x))
      return false;
  }
  for (int i = 0; i < body.m_faces.size(); ++i) {
    const btSoftBody::Face& face = body.m_faces[i];
    for (const btSoftBody::Node* const node : face.m_n)
      if (!holds(face.m_leaf->volume, node->m_x) || !holds(body.m_fdbvt.m_root->volume, node->m_x))
        return false;
  }
  return true;
}

}  // namespace

TEST_CASE("Bullet finds the contacts of soft bodies again after LazyCCD is detached") {
  const bool is_deformable = GENERATE(true, false);
  CAPTURE(is_deformable);
  StockWorld w(is_deformable);
  Attachment attachment(w.world(), one_thread());
  REQUIRE(attachment.is_attached());
  btSoftBody* const held = w.add_cloth(0, 0, 1, 9, true);
  btSoftBody* const falling = w.add_cloth(0, is_deformable ? 0.5 : 0.2, 0.4, 9, false);
  w.steps(10);
  REQUIRE(held->m_fdbvt.empty());
  attachment.detach();
  CHECK(has_current_trees(*held));
  CHECK(has_current_trees(*falling));
  CHECK(w.steps(120) > 0);
}

TEST_CASE("Bullet finds the contacts of cloth with a ball again after LazyCCD is detached") {
  StockWorld w(true);
  Attachment attachment(w.world(), one_thread());
  w.add_cloth(0, 0, 1, 5, true);
  const btRigidBody& ball = w.add_ball(btVector3(btScalar(0.25), btScalar(0.5), btScalar(0.25)));
  w.steps(10);
  attachment.detach();
  w.steps(120);
  CHECK(ball.getWorldTransform().getOrigin().y() > btScalar(-0.5));
}

TEST_CASE("bodies that sleep have current trees after LazyCCD is detached") {
  const bool is_deformable = GENERATE(true, false);
  CAPTURE(is_deformable);
  StockWorld w(is_deformable);
  Attachment attachment(w.world(), one_thread());
  btSoftBody* const cloth = w.add_cloth(0, 0, 1, 9, false);
  cloth->setSelfCollision(true);
  w.steps(40);
  cloth->forceActivationState(ISLAND_SLEEPING);
  w.steps(12);
  REQUIRE(attachment.step_stats().sleeping_bodies == 1);
  attachment.detach();
  CHECK(has_current_trees(*cloth));
  CHECK(cloth->m_fdbvnt != nullptr);  // Bullet's contacts within the body read it
}

TEST_CASE("a body in two components has both trees after LazyCCD is detached") {
  // Bullet itself never finishes the trees of such a body.
  const bool is_deformable = GENERATE(true, false);
  CAPTURE(is_deformable);
  StockWorld w(is_deformable);
  Attachment attachment(w.world(), one_thread());
  const btScalar corners[] = {0, 0, 0, 1, 0, 0, 0, 0, 1, 3, 0, 0, 4, 0, 0, 3, 0, 1};
  const int triangles[] = {0, 1, 2, 3, 4, 5};
  btSoftBody* const body =
      w.add(btSoftBodyHelpers::CreateFromTriMesh(w.info(), corners, triangles, 2, false));
  w.steps(10);
  attachment.detach();
  CHECK(has_current_trees(*body));
  REQUIRE(body->m_fdbvnt != nullptr);
  REQUIRE(body->m_fdbvnt->isinternal());
  CHECK(body->m_fdbvnt->childs[0]->data != body->m_fdbvnt->childs[1]->data);
  w.steps(10);
  CHECK(has_current_trees(*body));
}

TEST_CASE("a new solver builds the face trees that its options make Bullet read") {
  StockWorld w(true);
  Attachment attachment(w.world(), one_thread());
  btSoftBody* const cloth = w.add_cloth(0, 0, 1, 5, true);
  const btRigidBody& ball = w.add_ball(btVector3(btScalar(0.25), btScalar(0.5), btScalar(0.25)));
  w.steps(10);
  bullet::SolverOptions options = one_thread();
  options.collide_rigid = false;
  attachment.restart(options);
  REQUIRE(attachment.is_attached());
  CHECK(cloth->m_fdbvt.empty());  // nothing has read it yet
  w.steps(120);
  CHECK(ball.getWorldTransform().getOrigin().y() > btScalar(-0.5));
  attachment.detach();
}

TEST_CASE("all nodes have numbers of their own after LazyCCD left out a sleeping body") {
  StockWorld w(true);
  btSoftBody* const first = w.add_cloth(0, 0, 0.5, 4, true);
  btSoftBody* const second = w.add_cloth(5, 0, 0.5, 4, true);
  w.steps(3);
  Attachment attachment(w.world(), one_thread());
  w.steps(3);
  const int which = GENERATE(0, 1);
  CAPTURE(which);
  (which == 0 ? first : second)->forceActivationState(ISLAND_SLEEPING);
  w.steps(3);
  REQUIRE(attachment.step_stats().sleeping_bodies == 1);
  attachment.detach();
  w.steps(1);
  std::set<int> numbers;
  for (const btSoftBody* const body : {first, second})
    for (int i = 0; i < body->m_nodes.size(); ++i) numbers.insert(body->m_nodes[i].index);
  CHECK(numbers.size() == 32);
  CHECK(*numbers.rbegin() == 31);
}
