// The deformable world: btDeformableMultiBodyDynamicsWorld.
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>

#include "lazyccd/bullet/deformable_body_solver.h"
#include "lazyccd/bullet/deformable_world.h"
#include "scenes/worlds/mended_bullet.h"
#include "scenes/worlds/world_with.h"

namespace lazyccd::scenes {
namespace {

class DeformableWorld : public WorldWith<bullet::btLazyDeformableBodySolver> {
 public:
  explicit DeformableWorld(const WorldOptions& options)
      // The springs are integrated explicitly, so stiff springs need short steps.
      : WorldWith(options),
        springs_(stiffness(options), stiffness(options) / 10),
        weight_(gravity_of(options)) {
    btDeformableBodySolver* const solver = lazy_ ? lazy_.get() : &stock_solver_;
    constraints_.setDeformableSolver(solver);
    if (lazy_ && !options.stock_world) {
      make<bullet::btLazyDeformableMultiBodyDynamicsWorld>(lazy_.get());
    } else if (options.collisions == Collisions::mended_bullet) {
      make<MendedDeformableWorld>(solver);
    } else {
      make<btDeformableMultiBodyDynamicsWorld>(solver);
    }
    world_->setGravity(gravity_of(options));
    info().m_gravity = gravity_of(options);
    info().air_density = 0;
  }
  ~DeformableWorld() override {
    for (const auto& body : bodies()) world_->removeSoftBody(body.get());
    for (const RigidBody& rigid : rigid_bodies()) world_->removeRigidBody(rigid.body.get());
  }

  btSoftBodyWorldInfo& info() override { return world_->getWorldInfo(); }
  btDiscreteDynamicsWorld& dynamics() override { return *world_; }

 private:
  static btScalar stiffness(const WorldOptions& options) {
    return options.dt > 1.0 / 120 ? btScalar(0.5) : btScalar(2);
  }
  template <class World, class Solver>
  void make(Solver* solver) {
    world_ = std::make_unique<World>(&base_.dispatcher, &base_.broadphase, &constraints_,
                                     &base_.configuration, solver);
  }
  void enter(btSoftBody* body, int group, int mask) override {
    using Flag = btSoftBody::fCollision;
    body->m_cfg.collisions = Flag::SDF_RD | Flag::SDF_RDN | Flag::SDF_RDF | Flag::VF_DD;
    body->m_cfg.kKHR = 1;
    body->m_cfg.kCHR = 1;
    body->m_sleepingThreshold = 0;
    world_->addSoftBody(body, group, mask);
    world_->addForce(body, &springs_);
    if (options().gravity != 0) world_->addForce(body, &weight_);
  }
  void leave(btSoftBody* body) override { world_->removeSoftBody(body); }

  btDeformableMultiBodyConstraintSolver constraints_;
  btDeformableMassSpringForce springs_;
  btDeformableGravityForce weight_;
  btDeformableBodySolver stock_solver_;
  std::unique_ptr<btDeformableMultiBodyDynamicsWorld> world_;
};

}  // namespace

std::unique_ptr<PhysicsWorld> make_deformable_world(const WorldOptions& options) {
  return std::make_unique<DeformableWorld>(options);
}

}  // namespace lazyccd::scenes
