#include "random/random_scene.h"

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "lazyccd/bullet/deformable_body_solver.h"
#include "lazyccd/bullet/deformable_world.h"
#include "lazyccd/bullet/soft_body_solver.h"
#include "random/rigid_bodies.h"
#include "random/soft_bodies.h"

namespace lazyccd::test {
namespace {

using Flag = btSoftBody::fCollision;

// Bullet's own forces did not stand the step: nothing more is to be learnt, m/s.
constexpr double exploded = 2000;

btScalar scalar(double x) { return static_cast<btScalar>(x); }

// Moves a kinematic body evenly.
class Mover : public btMotionState {
 public:
  Mover(const btTransform& pose, const btVector3& velocity, const btVector3& spin)
      : pose_(pose), velocity_(velocity), spin_(spin) {}
  void getWorldTransform(btTransform& pose) const override { pose = pose_; }
  void setWorldTransform(const btTransform&) override {}
  void turn_to(const btVector3& velocity, const btVector3& spin) {
    velocity_ = velocity;
    spin_ = spin;
  }
  void advance(double seconds) {
    pose_.getOrigin() += scalar(seconds) * velocity_;
    const btVector3 turn = scalar(seconds) * spin_;
    if (turn.length() > 0) {
      const btQuaternion rotation(turn.normalized(), turn.length());
      pose_.setRotation((rotation * pose_.getRotation()).normalized());
    }
  }

 private:
  btTransform pose_;
  btVector3 velocity_, spin_;
};

struct Rigid {
  Shape shape;
  std::unique_ptr<Mover> mover;
  std::unique_ptr<btRigidBody> body;
  bool seen = false;  // by LazyCCD, where it was made
};

// Pinned nodes that the application moves: puts elsewhere, or gives a velocity.
struct Driven {
  btSoftBody* body;
  btVector3 velocity;
  bool puts;
  bool seen = false;  // by LazyCCD, where it was made or put
};

class Scene {
 public:
  Scene(std::uint32_t number, scenes::World kind, scenes::Collisions collisions,
        const bullet::Options& options)
      : collisions_(collisions), dice_(number), soft_solver_(options), deformable_solver_(options) {
    make_world(kind);
    size_ = dice_.chance(0.85) ? dice_.across_scales(0.1, 3) : dice_.across_scales(0.01, 30);
    if (dice_.chance(0.1)) {
      far_ = dice_.in_cube(1e4);
      note("far");
    }
    if (dice_.chance(0.7)) gravity_ = scalar(dice_.uniform(0, 20)) * dice_.direction();
    world_->setGravity(gravity_);
    info_->m_gravity = gravity_;
    if (dice_.chance(0.8)) info_->air_density = 0;
    margin_ = dice_.chance(0.2) ? 0 : dice_.across_scales(1e-4, 0.05) * size_;
    const double rates[] = {30, 60, 120, 240, 480};
    dt_ = 1 / rates[dice_.below(5)];
    varying_ = dice_.chance(0.15);
    substeps_ = dice_.chance(0.2) ? 2 + dice_.below(3) : 0;
    speed_ = dice_.chance(0.15) ? 0 : dice_.across_scales(0.1, 100);
    spread_ = dice_.uniform(0.6, 1.5) * size_;
    for (int i = dice_.below(4); i > 0; --i) add_rigid();
    for (int i = 1 + dice_.below(4); i > 0; --i) add_soft();
    for (const Rigid& rigid : rigid_) world_->addRigidBody(rigid.body.get());
    world_->setInternalTickCallback(&Scene::between_substeps, this, true);
    report_.what += std::string(" dt=1/") + std::to_string(std::lround(1 / dt_)) +
                    (varying_ ? " varying" : "") +
                    (substeps_ ? " substeps=" + std::to_string(substeps_) : "") +
                    " margin=" + std::to_string(margin_) + " size=" + std::to_string(size_) +
                    " speed=" + std::to_string(speed_);
  }
  ~Scene() {
    for (const auto& body : soft_) remove(*body);
    for (const Rigid& rigid : rigid_) world_->removeRigidBody(rigid.body.get());
  }

  SceneReport run(const std::function<void(const SceneStep&)>& after_step) {
    report_.steps = 30 + dice_.below(60);
    inspector_.restart(soft_, inspected());
    report_.vertices = inspector_.vertex_count();
    report_.kinetic_at_start = kinetic_energy(&report_.fastest_at_start);
    double now = dt_;
    for (int i = 0; i < report_.steps && report_.finite && report_.fastest < exploded; ++i) {
      meddle(i);
      if (varying_) now = dt_ * dice_.uniform(0.3, 1);
      // The first step shows LazyCCD where everything is.
      if (i > 0) drive(now * std::max(1, substeps_));
      substep_ = 0;
      const auto start = std::chrono::steady_clock::now();
      seconds_inspecting_ = 0;
      step_ = i;
      if (substeps_) {
        world_->stepSimulation(scalar(now * substeps_), substeps_, scalar(now));
      } else {
        world_->stepSimulation(scalar(now), 0, scalar(now));
      }
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      const double seconds = took.count() - seconds_inspecting_;
      report_.slowest_step = std::max(report_.slowest_step, seconds);
      const std::int64_t before = report_.crossings;
      inspect();
      if (after_step) after_step({i, seconds, report_.crossings - before, stats(), inspector_});
    }
    report_.stats = is_rigid() ? soft_solver_.total_stats() : deformable_solver_.total_stats();
    report_.status = is_rigid() ? soft_solver_.status() : deformable_solver_.status();
    return report_;
  }

 private:
  const bullet::StepStats& stats() const {
    return is_rigid() ? soft_solver_.step_stats() : deformable_solver_.step_stats();
  }
  bool is_lazy() const { return collisions_ == scenes::Collisions::lazyccd; }
  bool is_rigid() const { return soft_world_ != nullptr; }
  void note(const std::string& word) { report_.what += " " + word; }

  void make_world(scenes::World kind) {
    if (kind == scenes::World::rigid) {
      auto world = std::make_unique<btSoftRigidDynamicsWorld>(&dispatcher_, &broadphase_, &solver_,
                                                              &configuration_,
                                                              is_lazy() ? &soft_solver_ : nullptr);
      info_ = &world->getWorldInfo();
      soft_world_ = world.get();
      world_ = std::move(world);
      note("R");
      return;
    }
    btDeformableBodySolver* solver = is_lazy() ? &deformable_solver_ : &bullets_solver_;
    constraints_.setDeformableSolver(solver);
    std::unique_ptr<btDeformableMultiBodyDynamicsWorld> world;
    if (dice_.chance(0.15) || !is_lazy()) {
      note("D stock");
      world = std::make_unique<btDeformableMultiBodyDynamicsWorld>(
          &dispatcher_, &broadphase_, &constraints_, &configuration_, solver);
    } else {
      note("D");
      world = std::make_unique<bullet::btLazyDeformableMultiBodyDynamicsWorld>(
          &dispatcher_, &broadphase_, &constraints_, &configuration_, &deformable_solver_);
    }
    info_ = &world->getWorldInfo();
    deformable_world_ = world.get();
    // Not setImplicit(true): where a node is pinned Bullet then writes behind its arrays, since
    // btDeformableBodySolver makes no room in them for the multipliers.
    world_ = std::move(world);
  }

  btTransform pose() { return btTransform(dice_.rotation(), far_ + dice_.in_cube(spread_)); }

  void add_rigid() {
    Rigid rigid;
    rigid.shape = random_shape(size_ * dice_.across_scales(0.3, 2), margin_, dice_);
    btTransform at = pose();
    if (rigid.shape.kind == "plane") at.setRotation(btQuaternion::getIdentity());
    const bool dynamic = rigid.shape.may_be_dynamic && dice_.chance(0.5);
    const bool kinematic = rigid.shape.may_move && !dynamic && dice_.chance(0.4);
    const double mass = dynamic ? dice_.across_scales(0.01, 100) : 0;
    btVector3 inertia(0, 0, 0);
    if (dynamic) rigid.shape.shape->calculateLocalInertia(scalar(mass), inertia);
    if (kinematic)
      rigid.mover = std::make_unique<Mover>(at, random_velocity(0.3),
                                            scalar(dice_.uniform(0, 5)) * dice_.direction());
    btRigidBody::btRigidBodyConstructionInfo info(scalar(mass), rigid.mover.get(),
                                                  rigid.shape.shape.get(), inertia);
    info.m_startWorldTransform = at;
    rigid.body = std::make_unique<btRigidBody>(info);
    rigid.body->setActivationState(DISABLE_DEACTIVATION);
    rigid.body->setFriction(scalar(dice_.uniform()));
    if (kinematic) {
      rigid.body->setCollisionFlags(rigid.body->getCollisionFlags() |
                                    btCollisionObject::CF_KINEMATIC_OBJECT);
      report_.driven = true;
    }
    if (dynamic) {
      rigid.body->setLinearVelocity(random_velocity(0.5));
      if (dice_.chance(0.15)) rigid.body->setAngularFactor(0);
      if (dice_.chance(0.1)) rigid.body->setLinearFactor(btVector3(1, 0, 1));
    }
    note(rigid.shape.kind + (dynamic ? "(dynamic)" : kinematic ? "(moving)" : ""));
    rigid_.push_back(std::move(rigid));
  }

  btVector3 random_velocity(double part) {
    return scalar(part * speed_ * dice_.uniform()) * dice_.direction();
  }

  // Towards the middle of everything, more or less.
  btVector3 thrown_from(const btVector3& place) {
    btVector3 to = far_ + dice_.in_cube(0.5 * spread_) - place;
    if (to.length2() == 0) to = btVector3(0, 1, 0);
    return scalar(speed_ * dice_.uniform()) * to.normalized();
  }

  void add_soft() {
    for (int attempt = 0; attempt < 30; ++attempt) {
      const double size =
          size_ * (dice_.chance(0.15) ? dice_.across_scales(0.01, 1) : dice_.uniform(0.4, 1.2));
      SoftBody made = random_soft_body(*info_, size, dice_);
      btSoftBody& body = *made.body;
      const btTransform at = pose();
      body.transform(at);
      body.getCollisionShape()->setMargin(scalar(margin_));
      // Drawn before the attempt is judged, so that each costs the same numbers.
      const bool self = dice_.chance(0.5);
      body.setSelfCollision(self);
      soft_.push_back(std::move(made.body));
      if (!is_clean() || !is_outside(body)) {
        soft_.pop_back();
        continue;
      }
      note(made.kind + (self ? "(self)" : ""));
      closed_ = made.kind == "ellipsoid" || made.kind == "hull" || made.kind == "torus";
      set_up(body);
      body.addVelocity(thrown_from(at.getOrigin()));
      if (dice_.chance(0.3)) {
        const btVector3 spin = scalar(dice_.uniform(0, 10)) * dice_.direction();
        for (int i = 0; i < body.m_nodes.size(); ++i) {
          btSoftBody::Node& node = body.m_nodes[i];
          if (node.m_im > 0) node.m_v += spin.cross(node.m_x - at.getOrigin());
        }
      }
      return;
    }
  }

  void set_up(btSoftBody& body) {
    body.setTotalMass(scalar(dice_.across_scales(1e-2, 1e2)), false);
    if (dice_.chance(0.15)) {
      const double spread = dice_.chance(0.2) ? 1e3 : 10;
      for (int i = 0; i < body.m_nodes.size(); ++i)
        body.setMass(i, body.getMass(i) * scalar(dice_.across_scales(1 / spread, spread)));
      note("masses");
    }
    if (dice_.chance(0.2)) {
      for (int i = 0; i < body.m_nodes.size(); ++i) {
        if (dice_.chance(0.15)) body.setMass(i, 0);
      }
      note("pinned");
      if (dice_.chance(0.3)) {
        driven_.push_back({&body, random_velocity(0.3), dice_.chance(0.5)});
        report_.driven = true;
        note("driven");
      }
    }
    body.setActivationState(DISABLE_DEACTIVATION);
    body.m_cfg.kDF = scalar(dice_.uniform());
    if (is_rigid()) {
      if (dice_.chance(0.6)) body.m_cfg.collisions = Flag::SDF_RS | Flag::VF_SS;
      body.m_materials[0]->m_kLST = scalar(dice_.uniform(0.05, 1));
      body.m_cfg.piterations = 1 + dice_.below(10);
      body.m_cfg.kDP = scalar(dice_.chance(0.5) ? 0 : 0.05);
      if (dice_.chance(0.2) && body.m_faces.size() > 0 && body.m_nodes.size() > 4)
        body.generateBendingConstraints(2);
      const double weight = static_cast<double>(body.getTotalMass()) * size_;
      if (closed_ && dice_.chance(0.3)) body.m_cfg.kPR = scalar(dice_.uniform(-2, 10) * weight);
      if (closed_ && dice_.chance(0.2)) body.m_cfg.kVC = scalar(dice_.uniform(0, 5) * weight);
      if (body.m_faces.size() > 3 && dice_.chance(0.15)) {
        body.setPose(dice_.chance(0.3), true);
        body.m_cfg.kMT = scalar(dice_.uniform(0, 0.5));
      }
      if (dice_.chance(0.1)) {
        body.m_cfg.aeromodel = btSoftBody::eAeroModel::V_TwoSided;
        body.m_cfg.kDG = body.m_cfg.kLF = scalar(dice_.uniform(0, 0.1));
      }
      if (dice_.chance(0.1)) body.m_cfg.diterations = 1 + dice_.below(3);
      if (dice_.chance(0.1)) body.m_cfg.viterations = 1 + dice_.below(3);
      soft_world_->addSoftBody(&body);
      return;
    }
    body.m_cfg.collisions = Flag::SDF_RD | Flag::VF_DD;
    if (dice_.chance(0.7)) body.m_cfg.collisions |= Flag::SDF_RDN;
    if (dice_.chance(0.3)) body.m_cfg.collisions |= Flag::SDF_RDF;
    body.m_cfg.kKHR = body.m_cfg.kCHR = 1;
    body.m_sleepingThreshold = 0;
    deformable_world_->addSoftBody(&body);
    // As stiff as an explicit step stands.
    double lightest = 1e30;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      if (body.m_nodes[i].m_im > 0)
        lightest = std::min(lightest, 1 / static_cast<double>(body.m_nodes[i].m_im));
    }
    const double k = std::min(0.03 * lightest / (dt_ * dt_), 1000.0);
    const double damping = dice_.uniform(0, 0.02) * lightest / dt_;
    add_force(body, std::make_unique<btDeformableMassSpringForce>(scalar(k), scalar(damping)));
    add_force(body, std::make_unique<btDeformableGravityForce>(gravity_));
    if (body.m_tetras.size() > 0 && dice_.chance(0.5)) {
      const double stiffness = 0.002 * lightest / (dt_ * dt_ * size_);
      add_force(body, std::make_unique<btDeformableNeoHookeanForce>(
                          scalar(stiffness), scalar(stiffness), scalar(0.01)));
      note("neo-hookean");
    }
  }

  void drive(double seconds) {
    for (Rigid& rigid : rigid_) {
      const bool first = !rigid.seen;
      rigid.seen = true;
      if (rigid.mover && !first) rigid.mover->advance(seconds);
    }
    for (Driven& driven : driven_) {
      const bool first = !driven.seen;
      driven.seen = true;
      if (first) continue;
      for (int i = 0; i < driven.body->m_nodes.size(); ++i) {
        btSoftBody::Node& node = driven.body->m_nodes[i];
        if (node.m_im > 0) continue;
        if (driven.puts) {
          node.m_x += scalar(seconds) * driven.velocity;
        } else {
          node.m_v = driven.velocity;
        }
      }
    }
  }

  void add_force(btSoftBody& body, std::unique_ptr<btDeformableLagrangianForce> force) {
    deformable_world_->addForce(&body, force.get());
    forces_.push_back(std::move(force));
  }

  void remove(btSoftBody& body) {
    const auto of_body = [&body](const Driven& driven) { return driven.body == &body; };
    driven_.erase(std::remove_if(driven_.begin(), driven_.end(), of_body), driven_.end());
    if (is_rigid()) {
      soft_world_->removeSoftBody(&body);
    } else {
      deformable_world_->removeSoftBody(&body);
    }
  }

  // What an application may do between two steps.
  void meddle(int step) {
    if (step == 0 || !dice_.chance(0.08) || soft_.empty()) return;
    const std::size_t which = static_cast<std::size_t>(dice_.below(static_cast<int>(soft_.size())));
    btSoftBody& body = *soft_[which];
    switch (dice_.below(15)) {
      case 0:
        remove(body);
        soft_.erase(soft_.begin() + static_cast<std::ptrdiff_t>(which));
        note("-" + std::to_string(step));
        break;
      case 1:
        add_soft();
        note("+" + std::to_string(step));
        break;
      case 2:
        body.addVelocity(random_velocity(1));
        break;
      case 3: {
        const int node = dice_.below(body.m_nodes.size());
        body.setMass(node, body.getMass(node) > 0 ? 0 : scalar(0.01));
        body.m_nodes[node].m_v.setZero();
        note("pin" + std::to_string(step));
        break;
      }
      case 4:
        body.setSelfCollision(false);
        break;
      case 5:
        body.setSelfCollision(true);
        if (!is_clean()) body.setSelfCollision(false);
        break;
      case 6: {
        btSoftBody::Node& node = body.m_nodes[dice_.below(body.m_nodes.size())];
        if (node.m_im > 0) node.m_v += random_velocity(1);
        break;
      }
      case 7:
        put_elsewhere(body);
        note("put" + std::to_string(step));
        break;
      case 8:
        body.getCollisionShape()->setMargin(scalar(dice_.across_scales(0.1, 10) * margin_));
        break;
      case 9:
        gravity_ = scalar(dice_.uniform(0, 20)) * dice_.direction();
        world_->setGravity(gravity_);
        info_->m_gravity = gravity_;
        break;
      case 10:
        body.forceActivationState(dice_.chance(0.5) ? ISLAND_SLEEPING : ACTIVE_TAG);
        note("sleep" + std::to_string(step));
        break;
      case 11:
        body.setTotalMass(body.getTotalMass() * scalar(dice_.across_scales(1, 10)));
        break;
      default:
        meddle_with_rigid(step);
    }
    inspector_.restart(soft_, inspected());
  }

  void meddle_with_rigid(int step) {
    if (rigid_.empty() || dice_.chance(0.2)) {
      add_rigid();
      const bool outside = std::all_of(soft_.begin(), soft_.end(), [this](const auto& soft) {
        return is_outside(*soft, rigid_.back());
      });
      if (outside && is_clean()) {
        world_->addRigidBody(rigid_.back().body.get());
        note("rigid+" + std::to_string(step));
      } else {
        rigid_.pop_back();
      }
      return;
    }
    const int which = dice_.below(static_cast<int>(rigid_.size()));
    Rigid& rigid = rigid_[static_cast<std::size_t>(which)];
    if (dice_.chance(0.2)) {
      world_->removeRigidBody(rigid.body.get());
      rigid_.erase(rigid_.begin() + which);
      note("rigid-" + std::to_string(step));
    } else if (rigid.mover) {
      rigid.mover->turn_to(random_velocity(0.3), scalar(dice_.uniform(0, 5)) * dice_.direction());
    } else if (!rigid.body->isStaticObject()) {
      rigid.body->setLinearVelocity(random_velocity(1));
      rigid.body->setAngularVelocity(scalar(dice_.uniform(0, 20)) * dice_.direction());
    }
  }

  bool is_clean() const { return Inspector::is_clean(soft_, inspected()); }

  // Where it meets nothing. What is pinned as a whole would sweep its way there.
  void put_elsewhere(btSoftBody& body) {
    std::vector<btVector3> places;
    bool is_free = false;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      places.push_back(body.m_nodes[i].m_x);
      is_free = is_free || body.m_nodes[i].m_im > 0;
    }
    const btVector3 by = dice_.in_cube(spread_);
    if (!is_free) return;
    for (Driven& driven : driven_) driven.seen = driven.seen && driven.body != &body;
    body.translate(by);
    if (is_clean() && is_outside(body)) return;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      body.m_nodes[i].m_x = body.m_nodes[i].m_q = places[static_cast<std::size_t>(i)];
    }
    body.updateBounds();
  }

  // Not within reach of what is round, whose polyhedra differ.
  static bool is_outside(const btSoftBody& body, const Rigid& rigid) {
    if (!rigid.shape.round) return true;
    btVector3 centre;
    btScalar radius;
    rigid.shape.shape->getBoundingSphere(centre, radius);
    centre = rigid.body->getWorldTransform() * centre;
    btVector3 lower, upper;
    body.getAabb(lower, upper);
    btVector3 nearest = centre;
    nearest.setMax(lower);
    nearest.setMin(upper);
    return nearest.distance(centre) >= radius;
  }
  bool is_outside(const btSoftBody& body) const {
    return std::all_of(rigid_.begin(), rigid_.end(),
                       [&body](const Rigid& rigid) { return is_outside(body, rigid); });
  }

  std::vector<Inspector::Obstacle> inspected() const {
    std::vector<Inspector::Obstacle> obstacles;
    for (const Rigid& rigid : rigid_) obstacles.push_back({rigid.body.get(), &rigid.shape.surface});
    return obstacles;
  }

  static void between_substeps(btDynamicsWorld* world, btScalar) {
    Scene& scene = *static_cast<Scene*>(world->getWorldUserInfo());
    if (scene.substep_++ > 0) scene.inspect();
  }

  void inspect() {
    const auto start = std::chrono::steady_clock::now();
    double fastest = 0;
    report_.finite = report_.finite && std::isfinite(kinetic_energy(&fastest));
    if (!report_.finite) return;
    report_.fastest = std::max(report_.fastest, fastest);
    const std::int64_t before = report_.crossings;
    const Inspector::Count crossed = inspector_.step(), pierced = inspector_.piercings();
    report_.crossings += crossed.others;
    if (report_.crossings > before && report_.first_crossing < 0) report_.first_crossing = step_;
    report_.piercings = std::max(report_.piercings, pierced.others);
    report_.overlaps += crossed.with_kinematic + pierced.with_kinematic;
    seconds_inspecting_ +=
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  double kinetic_energy(double* fastest) const {
    double twice = 0;
    for (const auto& body : soft_) {
      for (int i = 0; i < body->m_nodes.size(); ++i) {
        const btSoftBody::Node& node = body->m_nodes[i];
        if (node.m_im > 0)
          twice += static_cast<double>(node.m_v.length2()) / static_cast<double>(node.m_im);
        *fastest = std::max(*fastest, static_cast<double>(node.m_v.length()));
        if (!std::isfinite(node.m_x.length2())) twice = std::nan("");
      }
    }
    for (const Rigid& rigid : rigid_) {
      if (rigid.body->isStaticOrKinematicObject()) continue;
      twice += static_cast<double>(rigid.body->getLinearVelocity().length2()) /
               static_cast<double>(rigid.body->getInvMass());
    }
    return twice / 2;
  }

  scenes::Collisions collisions_;
  Dice dice_;
  btSoftBodyRigidBodyCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDeformableMultiBodyConstraintSolver constraints_;
  bullet::btLazySoftBodySolver soft_solver_;
  bullet::btLazyDeformableBodySolver deformable_solver_;
  btDeformableBodySolver bullets_solver_;
  std::unique_ptr<btDiscreteDynamicsWorld> world_;
  btSoftRigidDynamicsWorld* soft_world_ = nullptr;
  btDeformableMultiBodyDynamicsWorld* deformable_world_ = nullptr;
  btSoftBodyWorldInfo* info_ = nullptr;

  double size_, margin_, dt_, speed_, spread_;
  bool varying_, closed_ = false;
  int substeps_, substep_ = 0, step_ = 0;
  double seconds_inspecting_ = 0;
  btVector3 far_ = btVector3(0, 0, 0), gravity_ = btVector3(0, 0, 0);
  std::vector<Rigid> rigid_;
  std::vector<Driven> driven_;
  std::vector<std::unique_ptr<btSoftBody>> soft_;
  std::vector<std::unique_ptr<btDeformableLagrangianForce>> forces_;
  Inspector inspector_;
  SceneReport report_;
};

}  // namespace

SceneReport run_random_scene(std::uint32_t number, scenes::World world,
                             scenes::Collisions collisions, const bullet::Options& options,
                             const std::function<void(const SceneStep&)>& after_step) {
  return Scene(number, world, collisions, options).run(after_step);
}

}  // namespace lazyccd::test
