// The rigid world: btSoftRigidDynamicsWorld.
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include "lazyccd/bullet/soft_body_solver.h"
#include "scenes/worlds/mended_bullet.h"
#include "scenes/worlds/world_with.h"

namespace lazyccd::scenes {
namespace {

class RigidWorld : public WorldWith<bullet::btLazySoftBodySolver> {
 public:
  explicit RigidWorld(const WorldOptions& options) : WorldWith(options) {
    world_ = std::make_unique<btSoftRigidDynamicsWorld>(
        &base_.dispatcher, &base_.broadphase, &constraints_, &base_.configuration, solver());
    world_->setGravity(gravity_of(options));
    info().m_gravity = gravity_of(options);
    info().air_density = 0;
  }
  ~RigidWorld() override {
    for (const auto& body : bodies()) world_->removeSoftBody(body.get());
    for (const RigidBody& rigid : rigid_bodies()) world_->removeRigidBody(rigid.body.get());
  }

  btSoftBodyWorldInfo& info() override { return world_->getWorldInfo(); }
  btDiscreteDynamicsWorld& dynamics() override { return *world_; }

 private:
  // Null: Bullet makes a solver of its own.
  btSoftBodySolver* solver() {
    if (lazy_) return lazy_.get();
    return options().collisions == Collisions::mended_bullet ? &mended_ : nullptr;
  }
  void enter(btSoftBody* body, int group, int mask) override {
    body->m_materials[0]->m_kLST = btScalar(0.9);
    body->m_cfg.piterations = 10;
    body->m_cfg.kDP = btScalar(0.005);
    body->m_cfg.collisions = btSoftBody::fCollision::SDF_RS | btSoftBody::fCollision::VF_SS;
    world_->addSoftBody(body, group, mask);
  }
  void leave(btSoftBody* body) override { world_->removeSoftBody(body); }

  MendedSoftBodySolver mended_;
  btSequentialImpulseConstraintSolver constraints_;
  std::unique_ptr<btSoftRigidDynamicsWorld> world_;
};

}  // namespace

std::unique_ptr<PhysicsWorld> make_rigid_world(const WorldOptions& options) {
  return std::make_unique<RigidWorld>(options);
}

}  // namespace lazyccd::scenes
