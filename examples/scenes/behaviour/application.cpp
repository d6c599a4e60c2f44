#include "scenes/behaviour/application.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcherMt.h>
#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftMultiBodyDynamicsWorld.h>
#include <LinearMath/btDefaultMotionState.h>
#include <LinearMath/btThreads.h>

#include <utility>

#include "lazyccd/bullet/deformable_body_solver.h"
#include "lazyccd/bullet/soft_body_solver.h"

namespace lazyccd::scenes::behaviour {
namespace {

std::unique_ptr<btCollisionDispatcher> make_dispatcher(btCollisionConfiguration& configuration,
                                                       bool threaded) {
  if (!threaded) return std::make_unique<btCollisionDispatcher>(&configuration);
  if (!btGetTaskScheduler()) {
    // Bullet built without threads has only the sequential scheduler.
    btITaskScheduler* const threads = btCreateDefaultTaskScheduler();
    btSetTaskScheduler(threads ? threads : btGetSequentialTaskScheduler());
  }
  return std::make_unique<btCollisionDispatcherMt>(&configuration, 1);
}

// Returns the surface that the counters see. Round shapes are polyhedra for LazyCCD, which lie
// inside the shape; so only the inner 97 % of them count.
std::optional<Triangles> surface_of(const btCollisionShape& shape) {
  if (shape.getShapeType() == STATIC_PLANE_PROXYTYPE || shape.isCompound()) return std::nullopt;
  Triangles surface = tessellate(shape);
  if (shape.isConvex() && !shape.isPolyhedral()) {
    for (btVector3& vertex : surface.vertices) vertex *= btScalar(0.97);
  }
  return surface;
}

// Gives all tetrahedra the orientation that Bullet's elastic forces need.
void orient(btSoftBody& body) {
  for (int i = 0; i < body.m_tetras.size(); ++i) {
    auto& corners = body.m_tetras[i].m_n;
    const btVector3& from = corners[0]->m_x;
    const btVector3 a = corners[1]->m_x - from, b = corners[2]->m_x - from,
                    c = corners[3]->m_x - from;
    if (a.dot(b.cross(c)) < 0) std::swap(corners[1], corners[2]);
  }
  body.initializeDmInverse();
}

}  // namespace

// Everything that a world of Bullet needs. Members are in the order in which Bullet needs them.
struct Application::Parts {
  explicit Parts(const Settings& settings)
      : dispatcher(make_dispatcher(configuration, settings.threaded_dispatcher)),
        weight(btVector3(0, scalar(-settings.gravity), 0)) {
    const bool lazy = settings.collisions == Collisions::lazyccd;
    if (settings.world == World::rigid) {
      // Null: the world makes Bullet's own solver.
      if (lazy) lazy_soft = std::make_unique<bullet::btLazySoftBodySolver>(settings.lazyccd);
      auto made = std::make_unique<btSoftMultiBodyDynamicsWorld>(
          dispatcher.get(), &broadphase, &constraints, &configuration, lazy_soft.get());
      soft_world = made.get();
      world = std::move(made);
    } else {
      if (lazy) {
        auto made = std::make_unique<bullet::btLazyDeformableBodySolver>(settings.lazyccd);
        lazy_deformable = made.get();
        deformable_solver = std::move(made);
      } else {
        deformable_solver = std::make_unique<btDeformableBodySolver>();
      }
      deformable_constraints.setDeformableSolver(deformable_solver.get());
      auto made = std::make_unique<btDeformableMultiBodyDynamicsWorld>(
          dispatcher.get(), &broadphase, &deformable_constraints, &configuration,
          deformable_solver.get());
      deformable_world = made.get();
      world = std::move(made);
    }
  }

  btSoftBodyRigidBodyCollisionConfiguration configuration;
  std::unique_ptr<btCollisionDispatcher> dispatcher;
  btDbvtBroadphase broadphase;
  btMultiBodyConstraintSolver constraints;
  btDeformableMultiBodyConstraintSolver deformable_constraints;
  btDeformableGravityForce weight;
  std::unique_ptr<bullet::btLazySoftBodySolver> lazy_soft;
  std::unique_ptr<btDeformableBodySolver> deformable_solver;
  bullet::btLazyDeformableBodySolver* lazy_deformable = nullptr;
  std::unique_ptr<btMultiBodyDynamicsWorld> world;
  btSoftMultiBodyDynamicsWorld* soft_world = nullptr;
  btDeformableMultiBodyDynamicsWorld* deformable_world = nullptr;
};

Application::Application(const Settings& settings)
    : settings_(settings), parts_(std::make_unique<Parts>(settings)), world_(parts_->world.get()) {
  const btVector3 gravity(0, scalar(-settings.gravity), 0);
  world_->setGravity(gravity);
  info().m_gravity = gravity;
  info().air_density = scalar(0);
  world_->setInternalTickCallback(
      [](btDynamicsWorld* world, btScalar) {
        auto& self = *static_cast<Application*>(world->getWorldUserInfo());
        // The state now is the end of the substep before. Only the first one of a frame has none.
        if (self.substep_++ > 0 && self.after_step_) self.after_step_();
        self.run(Moment::before_tick);
      },
      this, true);
  world_->setInternalTickCallback(
      [](btDynamicsWorld* world, btScalar) {
        static_cast<Application*>(world->getWorldUserInfo())->run(Moment::after_tick);
      },
      this, false);
  if (parts_->deformable_world) {
    parts_->deformable_world->setSolverCallback(
        [](btScalar, btDeformableMultiBodyDynamicsWorld* world) {
          static_cast<Application*>(world->getWorldUserInfo())->run(Moment::in_solver);
        });
  }
}

Application::~Application() {
  for (const auto& constraint : constraints_) world_->removeConstraint(constraint.get());
  multibodies_.clear();
  for (const auto& body : soft_bodies_) world_->removeCollisionObject(body.get());
  for (const auto& body : rigid_bodies_) world_->removeRigidBody(body.get());
}

btSoftBodyWorldInfo& Application::info() {
  return parts_->soft_world ? parts_->soft_world->getWorldInfo()
                            : parts_->deformable_world->getWorldInfo();
}

btDispatcher& Application::dispatcher() { return *parts_->dispatcher; }

btSoftBody* Application::add(std::unique_ptr<btSoftBody> body, double margin, double stiffness) {
  using Flag = btSoftBody::fCollision;
  if (is_rigid()) {
    body->m_cfg.collisions = Flag::SDF_RS | Flag::VF_SS;
    body->m_cfg.piterations = 5;
    for (int i = 0; i < body->m_materials.size(); ++i) body->m_materials[i]->m_kLST = scalar(0.8);
    return add_as_is(std::move(body), margin);
  }
  body->m_cfg.collisions =
      Flag::SDF_RD | Flag::SDF_RDF | Flag::SDF_MDF | Flag::SDF_RDN | Flag::VF_DD;
  body->m_cfg.kKHR = body->m_cfg.kCHR = 1;
  btSoftBody* const added = add_as_is(std::move(body), margin);
  // A hundredth of the stiffness damps without making explicit steps unstable.
  add_force(added, std::make_unique<btDeformableMassSpringForce>(scalar(stiffness),
                                                                 scalar(0.01 * stiffness)));
  return added;
}

btSoftBody* Application::add_solid(std::unique_ptr<btSoftBody> body, double modulus,
                                   double margin) {
  if (is_rigid()) return add(std::move(body), margin);
  orient(*body);
  using Flag = btSoftBody::fCollision;
  body->m_cfg.collisions = Flag::SDF_RD | Flag::SDF_RDF | Flag::SDF_MDF | Flag::VF_DD;
  body->m_cfg.kKHR = body->m_cfg.kCHR = 1;
  parts_->deformable_world->setImplicit(true);
  parts_->deformable_world->setUseProjection(true);
  btSoftBody* const added = add_as_is(std::move(body), margin);
  // Damping of deformation only; Bullet's other coefficient brakes rigid motion.
  add_force(added, std::make_unique<btDeformableLinearElasticityForce>(
                       scalar(modulus), scalar(modulus), scalar(0), scalar(0.01)));
  return added;
}

void Application::hold(btRigidBody* body) {
  constraints_.push_back(std::make_unique<btPoint2PointConstraint>(*body, btVector3(0, 0, 0)));
  world_->addConstraint(constraints_.back().get());
}

void Application::do_not_count(const btCollisionObject* body) {
  for (Solid& solid : solids_) {
    if (solid.object == body) solid.surface.reset();
  }
}

btSoftBody* Application::add_as_is(std::unique_ptr<btSoftBody> body, double margin) {
  body->getCollisionShape()->setMargin(scalar(margin));
  soft_bodies_.push_back(std::move(body));
  btSoftBody* const added = soft_bodies_.back().get();
  added->setActivationState(DISABLE_DEACTIVATION);
  if (is_rigid()) {
    parts_->soft_world->addSoftBody(added);
  } else {
    added->m_sleepingThreshold = 0;
    parts_->deformable_world->addSoftBody(added);
    if (settings_.gravity != 0) parts_->deformable_world->addForce(added, &parts_->weight);
  }
  return added;
}

void Application::add_force(btSoftBody* body, std::unique_ptr<btDeformableLagrangianForce> force) {
  parts_->deformable_world->addForce(body, force.get());
  forces_.push_back(std::move(force));
}

btRigidBody* Application::add(std::unique_ptr<btCollisionShape> shape, const btTransform& pose,
                              double mass, double friction) {
  btVector3 inertia(0, 0, 0);
  if (mass > 0) shape->calculateLocalInertia(scalar(mass), inertia);
  motions_.push_back(std::make_unique<btDefaultMotionState>(pose));
  rigid_bodies_.push_back(
      std::make_unique<btRigidBody>(scalar(mass), motions_.back().get(), shape.get(), inertia));
  btRigidBody* const body = rigid_bodies_.back().get();
  body->setFriction(scalar(friction));
  if (mass > 0) body->setActivationState(DISABLE_DEACTIVATION);
  solids_.push_back({body, surface_of(*shape)});
  shapes_.push_back(std::move(shape));
  world_->addRigidBody(body);
  return body;
}

btRigidBody* Application::add_kinematic(std::unique_ptr<btCollisionShape> shape,
                                        const btTransform& pose) {
  btRigidBody* const body = add(std::move(shape), pose);
  world_->removeRigidBody(body);
  body->setCollisionFlags(body->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  body->setActivationState(DISABLE_DEACTIVATION);
  world_->addRigidBody(body);
  return body;
}

Multibody* Application::add(std::unique_ptr<Multibody> body) {
  body->add_to(*world_);
  for (const auto& collider : body->colliders())
    solids_.push_back({collider.get(), surface_of(*collider->getCollisionShape())});
  multibodies_.push_back(std::move(body));
  return multibodies_.back().get();
}

void Application::call(Moment moment, std::function<void(double)> function) {
  functions_.push_back({moment, std::move(function)});
}

void Application::call_at(double seconds, std::function<void()> function) {
  call(Moment::between_steps, [=, done = false](double now) mutable {
    if (done || now < seconds - 0.5 * frame_seconds) return;
    done = true;
    function();
  });
}

void Application::run(Moment moment) {
  const double now =
      time_ + (moment == Moment::between_steps ? 0 : frame_seconds * substep_ / settings_.substeps);
  for (const auto& [when, function] : functions_) {
    if (when == moment) function(now);
  }
}

bool Application::take_jump() {
  const bool result = jumped_;
  jumped_ = false;
  return result;
}

void Application::frame(const std::function<void()>& after_step) {
  run(Moment::between_steps);
  after_step_ = after_step;
  substep_ = 0;
  const int n = settings_.substeps;
  // A little less than the frame in substeps, so that rounding does not leave one substep over.
  world_->stepSimulation(scalar(frame_seconds), n, scalar(frame_seconds * (1 - 1e-6) / n));
  time_ += frame_seconds;
  if (substep_ > 0 && after_step) after_step();
}

const bullet::StepStats* Application::total_stats() const {
  if (parts_->lazy_soft) return &parts_->lazy_soft->total_stats();
  return parts_->lazy_deformable ? &parts_->lazy_deformable->total_stats() : nullptr;
}

Span<const bullet::StepContact> Application::contacts() const {
  if (parts_->lazy_soft) return parts_->lazy_soft->contacts();
  return parts_->lazy_deformable ? parts_->lazy_deformable->contacts()
                                 : Span<const bullet::StepContact>();
}

std::string Application::status() const {
  if (parts_->lazy_soft) return parts_->lazy_soft->status();
  return parts_->lazy_deformable ? parts_->lazy_deformable->status() : "";
}

}  // namespace lazyccd::scenes::behaviour
