#include "random/random_scene.h"

#include <BulletDynamics/ConstraintSolver/btPoint2PointConstraint.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "random/multibody_chain.h"
#include "random/random_world.h"
#include "random/rigid_bodies.h"
#include "random/soft_bodies.h"
#include "random/soft_body_changes.h"

namespace lazyccd::test {
namespace {

// A scene with a faster node has exploded and ends, m/s: Bullet's own forces are unstable at this
// step.
constexpr double explosion_speed = 2000;

// Positions farther from the origin count as not finite, metres: Bullet's hash of positions
// overflows there.
constexpr double max_distance = 1e7;

// Frequency of the fixed step in scenes with frames of random length, Hz.
constexpr double frequency = 240;

// Moves a kinematic body at constant velocity.
class Mover : public btMotionState {
 public:
  Mover(const btTransform& pose, const btVector3& velocity, const btVector3& angular_velocity)
      : pose_(pose), velocity_(velocity), spin_(angular_velocity) {}
  void getWorldTransform(btTransform& pose) const override { pose = pose_; }
  void setWorldTransform(const btTransform&) override {}
  void set_velocity(const btVector3& velocity, const btVector3& angular_velocity) {
    velocity_ = velocity;
    spin_ = angular_velocity;
  }
  void put(const btTransform& pose) { pose_ = pose; }
  void advance(double dt) {
    pose_.getOrigin() += scalar(dt) * velocity_;
    const btVector3 rotation = scalar(dt) * spin_;
    if (rotation.length() > 0) {
      const btQuaternion turned(rotation.normalized(), rotation.length());
      pose_.setRotation((turned * pose_.getRotation()).normalized());
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
  int layer = 0;
  bool seen = false;                            // LazyCCD has read it at its first place
  std::unique_ptr<btTransform> goal = nullptr;  // the application moves it here before the step
  bool was_put = false;                         // was moved to a goal although it is static
};

// Pinned nodes with prescribed motion: the application sets their positions or their velocity.
struct Driven {
  btSoftBody* body;
  btVector3 velocity;
  bool puts;          // true: sets positions
  bool seen = false;  // LazyCCD has read it at its first place, or where displace() put it
};

class Scene {
  struct SceneIsOver {};

 public:
  Scene(std::uint32_t number, scenes::World kind, scenes::Collisions collisions,
        const bullet::SolverOptions& options)
      : random_(number), world_(kind, collisions, with_listener(options), random_) {
    note(world_.name());
    size_ = random_.chance(0.85) ? random_.across_scales(0.1, 3) : random_.across_scales(1e-3, 100);
    if (random_.chance(0.1)) {
      far_ = scalar(random_.across_scales(1e3, 1e5)) * random_.direction();
      note("far");
    }
    if (random_.chance(0.7))
      world_.set_gravity(scalar(random_.uniform(0, 20)) * random_.direction());
    if (random_.chance(0.8)) world_.info().air_density = 0;
    if (random_.chance(0.05)) world_.info().m_maxDisplacement = scalar(0.1 * size_);
    margin_ =
        random_.chance(0.2) ? 0 : random_.across_scales(1e-4, random_.chance(0.1) ? 0.5 : 0.05);
    margin_ *= size_;
    const double rates[] = {30, 60, 120, 240, 480, 1000};
    dt_ = 1 / rates[random_.below(6)];
    varying_ = random_.chance(0.15);
    substeps_ = random_.chance(0.2) ? 2 + random_.below(3) : 0;
    in_real_time_ = random_.chance(0.1);
    if (in_real_time_) note("real-time");
    deletes_ = random_.chance(0.1);
    speed_ = random_.chance(0.15) ? 0 : random_.across_scales(0.1, random_.chance(0.1) ? 200 : 100);
    spread_ = random_.uniform(0.6, 1.5) * size_;
    for (int i = random_.below(4); i > 0; --i) add_rigid();
    add_chain();
    for (int i = 1 + random_.below(4); i > 0; --i) add_soft();
    for (const Rigid& rigid : rigid_) world_.add(*rigid.body, rigid.layer);
    if (rigid_.size() > 1 && random_.chance(0.2)) join();
    world_.bullets().setInternalTickCallback(&Scene::between_substeps, this, true);
    report_.what += std::string(" dt=1/") + std::to_string(std::lround(1 / dt_)) +
                    (varying_ ? " varying" : "") +
                    (substeps_ ? " substeps=" + std::to_string(substeps_) : "") +
                    " margin=" + std::to_string(margin_) + " size=" + std::to_string(size_) +
                    " speed=" + std::to_string(speed_);
  }
  ~Scene() {
    for (const auto& body : soft_) remove(*body);
    if (joint_) world_.bullets().removeConstraint(joint_.get());
    for (const Rigid& rigid : rigid_) world_.bullets().removeRigidBody(rigid.body.get());
  }

  SceneReport run(const std::function<void(const SceneStep&)>& after_step) {
    report_.steps = 30 + random_.below(60);
    restart_checks();
    report_.vertices = penetration_check_.vertex_count();
    report_.kinetic_at_start = kinetic_energy(&report_.fastest_at_start);
    for (int i = 0; i < report_.steps && !is_over(); ++i) {
      change_scene(i);
      const double now = varying_ ? dt_ * random_.across_scales(0.1, 1) : dt_;
      const double frame =
          in_real_time_ ? random_.uniform(1, 9) / frequency : now * std::max(1, substeps_);
      // LazyCCD reads the initial positions in the first step.
      if (i > 0) prescribed_speed(frame);
      substep_ = 0;
      const std::int64_t before = report_.crossings;
      const auto start = std::chrono::steady_clock::now();
      seconds_inspecting_ = 0;
      step_ = i;
      try {
        if (in_real_time_) {
          world_.bullets().stepSimulation(scalar(frame), 10, scalar(1 / frequency));
        } else {
          world_.bullets().stepSimulation(scalar(frame), substeps_, scalar(now));
        }
      } catch (const SceneIsOver&) {
      }
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
      const double dt = took.count() - seconds_inspecting_;
      report_.slowest_step = std::max(report_.slowest_step, dt);
      if (!is_over()) inspect();
      if (!is_over()) inspect_frame();
      if (after_step)
        after_step({report_.what, i, dt, report_.crossings - before, world_.step_stats(),
                    penetration_check_});
    }
    report_.stats = world_.total_stats();
    report_.status = world_.status();
    return report_;
  }

 private:
  void note(const std::string& word) { report_.what += " " + word; }

  btTransform pose() { return btTransform(random_.rotation(), far_ + random_.in_cube(spread_)); }

  void add_rigid() {
    Rigid rigid;
    rigid.shape = random_shape(size_ * random_.across_scales(0.3, 2), margin_, random_);
    btTransform at = pose();
    if (rigid.shape.kind == "plane" && (random_.chance(0.5) || !far_.isZero()))
      at.setRotation(btQuaternion::getIdentity());
    const bool dynamic = rigid.shape.may_be_dynamic && random_.chance(0.5);
    const bool kinematic = rigid.shape.may_move && !dynamic && random_.chance(0.4);
    const double mass = dynamic ? random_.across_scales(0.01, 100) : 0;
    btVector3 inertia(0, 0, 0);
    if (dynamic) rigid.shape.shape->calculateLocalInertia(scalar(mass), inertia);
    if (kinematic)
      rigid.mover = std::make_unique<Mover>(at, random_velocity(0.3),
                                            scalar(random_.uniform(0, 5)) * random_.direction());
    btRigidBody::btRigidBodyConstructionInfo info(scalar(mass), rigid.mover.get(),
                                                  rigid.shape.shape.get(), inertia);
    info.m_startWorldTransform = at;
    rigid.body = std::make_unique<btRigidBody>(info);
    if (kinematic || random_.chance(0.8)) rigid.body->setActivationState(DISABLE_DEACTIVATION);
    rigid.body->setFriction(scalar(random_.chance(0.9) ? random_.uniform() : 10));
    if (random_.chance(0.2)) rigid.body->setRestitution(1);
    if (random_.chance(0.1)) {
      rigid.body->setCcdMotionThreshold(scalar(0.1 * size_));
      rigid.body->setCcdSweptSphereRadius(scalar(0.05 * size_));
    }
    rigid.layer = random_.below(3);
    if (kinematic) {
      rigid.body->setCollisionFlags(rigid.body->getCollisionFlags() |
                                    btCollisionObject::CF_KINEMATIC_OBJECT);
      report_.driven = true;
    }
    if (dynamic) {
      rigid.body->setLinearVelocity(random_velocity(0.5));
      if (random_.chance(0.15)) rigid.body->setAngularFactor(0);
      if (random_.chance(0.1)) rigid.body->setLinearFactor(btVector3(1, 0, 1));
    }
    note(rigid.shape.kind + (dynamic ? "(dynamic)" : kinematic ? "(moving)" : ""));
    rigid_.push_back(std::move(rigid));
  }

  // Sometimes adds a multibody, if the world's class supports them.
  void add_chain() {
    auto* world = dynamic_cast<btMultiBodyDynamicsWorld*>(&world_.bullets());
    if (!world || !random_.chance(0.1)) return;
    const double length = size_ * random_.uniform(0.2, 0.6);
    chain_ = std::make_unique<Chain>(far_ + random_.in_cube(spread_), length,
                                     std::min(speed_ / length, 20.0), random_);
    chain_->add_to(*world);
    report_.driven = true;
    note("chain");
  }

  btVector3 random_velocity(double part) {
    return scalar(part * speed_ * random_.uniform()) * random_.direction();
  }

  // A random velocity, roughly towards the centre of the scene.
  btVector3 thrown_from(const btVector3& place) {
    btVector3 to = far_ + random_.in_cube(0.5 * spread_) - place;
    if (to.length2() == 0) to = btVector3(0, 1, 0);
    return scalar(speed_ * random_.uniform()) * to.normalized();
  }

  // Connects the first two rigid bodies by a joint, if one of them is dynamic.
  void join() {
    btRigidBody &a = *rigid_[0].body, &b = *rigid_[1].body;
    if (a.isStaticOrKinematicObject() && b.isStaticOrKinematicObject()) return;
    const btVector3 middle = (a.getCenterOfMassPosition() + b.getCenterOfMassPosition()) / 2;
    joint_ = std::make_unique<btPoint2PointConstraint>(
        a, b, a.getCenterOfMassTransform().invXform(middle),
        b.getCenterOfMassTransform().invXform(middle));
    world_.bullets().addConstraint(joint_.get(), random_.chance(0.5));
    note("joint");
  }

  void add_soft() {
    for (int attempt = 0; attempt < 30; ++attempt) {
      const double size = size_ * (random_.chance(0.15) ? random_.across_scales(0.01, 1)
                                                        : random_.uniform(0.4, 1.2));
      btTransform at = pose();
      SoftBody made = random_soft_body(world_.info(), size, random_);
      if (attempt < 3 && !rigid_.empty() && random_.chance(0.15)) {
        const Rigid& inside =
            rigid_[static_cast<std::size_t>(random_.below(static_cast<int>(rigid_.size())))];
        if (inside.shape.kind == "box") {
          const btVector3& corner = inside.shape.surface.vertices.back();
          made = sleeve(world_.info(), corner, random_);
          at = inside.body->getWorldTransform();
        } else if (inside.shape.shape->isConcave()) {
          made = random_rope(world_.info(), size, random_);
        }
      }
      btSoftBody& body = *made.body;
      body.transform(at);
      body.getCollisionShape()->setMargin(scalar(margin_));
      // Drawn before the attempt is tested, so that every attempt uses as many random numbers.
      const bool self = random_.chance(0.5);
      body.setSelfCollision(self);
      soft_.push_back(std::move(made.body));
      if (!is_clean() || !is_outside(body)) {
        soft_.pop_back();
        continue;
      }
      note(made.kind + (self ? "(self)" : ""));
      const bool closed = made.kind == "ellipsoid" || made.kind == "hull" || made.kind == "torus";
      const ChangeLimits limits{size_, speed_, dt_, closed};
      report_.what += set_up(body, limits, world_, random_);
      world_.add(body, random_.below(3));
      report_.what += add_forces(body, limits, world_, random_);
      limits_.push_back(limits);
      put_in_motion(body, at.getOrigin());
      return;
    }
  }

  void put_in_motion(btSoftBody& body, const btVector3& centre) {
    const auto is_pinned = [&body](int node) { return body.m_nodes[node].m_im == 0; };
    bool pinned = false;
    for (int i = 0; i < body.m_nodes.size(); ++i) pinned = pinned || is_pinned(i);
    if (pinned && random_.chance(0.3)) {
      driven_.push_back({&body, random_velocity(0.3), random_.chance(0.5)});
      report_.driven = true;
      note("driven");
    }
    body.addVelocity(thrown_from(centre));
    if (random_.chance(0.3)) {
      const btVector3 angular_velocity = scalar(random_.uniform(0, 10)) * random_.direction();
      for (int i = 0; i < body.m_nodes.size(); ++i) {
        btSoftBody::Node& node = body.m_nodes[i];
        if (node.m_im > 0) node.m_v += angular_velocity.cross(node.m_x - centre);
      }
    }
    if (!rigid_.empty() && random_.chance(0.1)) anchor(body);
  }

  void anchor(btSoftBody& body) {
    const int which = random_.below(static_cast<int>(rigid_.size()));
    btRigidBody& to = *rigid_[static_cast<std::size_t>(which)].body;
    // Bullet anchors free nodes only. Nodes anchored to a kinematic body count as driven.
    for (int i = 1 + random_.below(3); i > 0; --i) {
      const int node = random_.below(body.m_nodes.size());
      if (body.m_nodes[node].m_im == 0) continue;
      if (world_.is_rigid()) {
        body.appendAnchor(node, &to, random_.chance(0.3), scalar(random_.uniform(0.3, 1)));
      } else {
        body.appendDeformableAnchor(node, &to);
      }
      note("anchor");
    }
    // In the deformable world anchored nodes follow the rigid body, whatever pulls at them.
    report_.driven = report_.driven || !world_.is_rigid() || to.isStaticOrKinematicObject();
  }

  void prescribed_speed(double dt) {
    for (Rigid& rigid : rigid_) {
      const bool first = !rigid.seen;
      rigid.seen = true;
      if (rigid.goal && rigid.mover) {
        rigid.mover->put(*rigid.goal);
      } else if (rigid.goal) {
        rigid.body->setCenterOfMassTransform(*rigid.goal);
      } else if (rigid.mover && !first) {
        rigid.mover->advance(dt);
      }
      rigid.goal.reset();
    }
    for (Driven& driven : driven_) {
      const bool first = !driven.seen;
      driven.seen = true;
      if (first) continue;
      for (int i = 0; i < driven.body->m_nodes.size(); ++i) {
        btSoftBody::Node& node = driven.body->m_nodes[i];
        if (node.m_im > 0) continue;
        if (driven.puts) {
          node.m_x += scalar(dt) * driven.velocity;
        } else {
          node.m_v = driven.velocity;
        }
      }
    }
  }

  // Deletes a soft body. Called between frames, or inside the on_contacts callback.
  void erase(std::size_t which) {
    remove(*soft_[which]);
    soft_.erase(soft_.begin() + static_cast<std::ptrdiff_t>(which));
    limits_.erase(limits_.begin() + static_cast<std::ptrdiff_t>(which));
  }

  bullet::SolverOptions with_listener(bullet::SolverOptions options) {
    options.on_contacts = [this](Span<const bullet::StepContact> contacts) {
      if (!deletes_ || !random_.chance(0.02)) return;
      const auto is_in_contact = [&](const auto& body) {
        return body.get() == contacts[0].body_a || body.get() == contacts[0].body_b;
      };
      const auto body = std::find_if(soft_.begin(), soft_.end(), is_in_contact);
      inspect();
      erase(static_cast<std::size_t>(body - soft_.begin()));
      note("deleted" + std::to_string(step_));
      restart_checks();
    };
    return options;
  }

  void remove(btSoftBody& body) {
    const auto of_body = [&body](const Driven& driven) { return driven.body == &body; };
    driven_.erase(std::remove_if(driven_.begin(), driven_.end(), of_body), driven_.end());
    world_.remove(body);
  }

  // Sometimes makes one random change, as an application may between two steps.
  void change_scene(int step) {
    if (step == 0 || !random_.chance(0.08) || soft_.empty()) return;
    const std::size_t which =
        static_cast<std::size_t>(random_.below(static_cast<int>(soft_.size())));
    btSoftBody& body = *soft_[which];
    const std::string at = std::to_string(step);
    switch (random_.below(12)) {
      case 0:
        erase(which);
        note("-" + at);
        break;
      case 1:
        add_soft();
        note("+" + at);
        break;
      case 2:
        body.setSelfCollision(true);
        if (!is_clean()) body.setSelfCollision(false);
        break;
      case 3:
        note(displace(body) + at);
        break;
      case 4:
        world_.set_gravity(scalar(random_.uniform(0, 20)) * random_.direction());
        break;
      case 5:
        dt_ = 1 / random_.across_scales(30, 1000);
        note("dt" + at);
        break;
      case 6:
      case 7:
      case 8:
        note(change(body, limits_[which], world_, random_) + at);
        break;
      default:
        change_rigid(step);
    }
    restart_checks();
  }

  void change_rigid(int step) {
    if (rigid_.empty() || random_.chance(0.2)) {
      add_rigid();
      const bool outside = std::all_of(soft_.begin(), soft_.end(), [this](const auto& soft) {
        return is_outside(*soft, rigid_.back());
      });
      if (outside && is_clean()) {
        world_.add(*rigid_.back().body, rigid_.back().layer);
        note("rigid+" + std::to_string(step));
      } else {
        rigid_.pop_back();
      }
      return;
    }
    const int which = random_.below(static_cast<int>(rigid_.size()));
    Rigid& rigid = rigid_[static_cast<std::size_t>(which)];
    btRigidBody& body = *rigid.body;
    if (random_.chance(0.2)) {
      if (is_needed(body)) return;
      world_.bullets().removeRigidBody(&body);
      rigid_.erase(rigid_.begin() + which);
      note("rigid-" + std::to_string(step));
    } else if (rigid.shape.may_move && random_.chance(0.2)) {
      put_elsewhere(rigid);
      note("rigid-put" + std::to_string(step));
    } else if (rigid.mover) {
      rigid.mover->set_velocity(random_velocity(0.3),
                                scalar(random_.uniform(0, 5)) * random_.direction());
    } else if (!body.isStaticObject()) {
      body.setLinearVelocity(random_velocity(1));
      body.setAngularVelocity(scalar(random_.uniform(0, 20)) * random_.direction());
      if (random_.chance(0.3)) {
        const double mass = random_.across_scales(0.01, 100);
        btVector3 inertia;
        body.getCollisionShape()->calculateLocalInertia(scalar(mass), inertia);
        body.setMassProps(scalar(mass), inertia);
        body.updateInertiaTensor();
      }
    }
  }

  // True if a joint or an anchor refers to the body.
  bool is_needed(const btRigidBody& body) const {
    if (joint_ && (&joint_->getRigidBodyA() == &body || &joint_->getRigidBodyB() == &body))
      return true;
    return std::any_of(soft_.begin(), soft_.end(), [&body](const auto& soft) {
      for (int i = 0; i < soft->m_anchors.size(); ++i) {
        if (soft->m_anchors[i].m_body == &body) return true;
      }
      for (int i = 0; i < soft->m_deformableAnchors.size(); ++i) {
        if (soft->m_deformableAnchors[i].m_cti.m_colObj == &body) return true;
      }
      return false;
    });
  }

  // Moves the body to a random pose where it intersects nothing. A static or kinematic body sweeps
  // there in the next step and pushes everything that is in its way; a dynamic body does not.
  void put_elsewhere(Rigid& rigid) {
    btRigidBody& body = *rigid.body;
    const btTransform from = body.getWorldTransform(), to = pose();
    if (is_needed(body)) return;
    const bool has_prescribed_motion = body.isStaticOrKinematicObject();
    if (has_prescribed_motion && !random_.chance(0.3)) return;
    body.setWorldTransform(to);
    const bool outside = std::all_of(soft_.begin(), soft_.end(),
                                     [&](const auto& soft) { return is_outside(*soft, rigid); });
    const bool clean = outside && is_clean();
    body.setWorldTransform(from);
    if (!clean) return;
    if (has_prescribed_motion) {
      rigid.goal = std::make_unique<btTransform>(to);
      rigid.was_put = true;
      report_.driven = true;
    } else {
      body.setCenterOfMassTransform(to);
      world_.teleported(body);
    }
  }

  bool is_clean() const { return PenetrationCheck::is_clean(soft_, obstacles_to_check()); }

  // Moves, rotates or scales the body, or moves one node, if the result intersects nothing. Bodies
  // whose nodes are all pinned are left out, because LazyCCD would sweep them to the new place.
  std::string displace(btSoftBody& body) {
    std::vector<btVector3> places;
    bool is_free = false;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      places.push_back(body.m_nodes[i].m_x);
      is_free = is_free || body.m_nodes[i].m_im > 0;
    }
    if (!is_free || body.m_anchors.size() + body.m_deformableAnchors.size() > 0) return "";
    for (Driven& driven : driven_) driven.seen = driven.seen && driven.body != &body;
    std::string word;
    const btVector3 centre = body.m_nodes[0].m_x;
    switch (random_.below(4)) {
      case 0:
        body.translate(random_.in_cube(spread_));
        word = "put";
        break;
      case 1:
        body.transform(btTransform(btQuaternion::getIdentity(), centre) *
                       btTransform(random_.rotation(), -centre));
        word = "turned";
        break;
      case 2: {
        body.translate(-centre);
        const btScalar scale = scalar(random_.uniform(0.5, 1.5));
        body.scale(btVector3(scale, scale, scale));
        body.translate(centre);
        word = "scaled";
        break;
      }
      default: {
        btSoftBody::Node& node = body.m_nodes[random_.below(body.m_nodes.size())];
        node.m_x += random_.in_cube(0.05 * size_);
        node.m_q = node.m_x;
        word = "node";
      }
    }
    if (is_clean() && is_outside(body)) return word;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      body.m_nodes[i].m_x = body.m_nodes[i].m_q = places[static_cast<std::size_t>(i)];
    }
    body.updateNormals();
    body.updateBounds();
    return "";
  }

  // True if the body lies strictly on one side of the plane y = 0 of this frame.
  static bool is_on_one_side(const btSoftBody& body, const btTransform& frame) {
    bool above = false, below = false;
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      const btScalar height = frame.invXform(body.m_nodes[i].m_x).y();
      above = above || height >= 0;
      below = below || height <= 0;
    }
    return above != below;
  }

  // A further condition for a clean start. Round shapes: the bodies' bounds must not overlap, since
  // LazyCCD uses another polyhedron than this test. Planes: the body must lie on one side, since a
  // plane continues beyond its triangles.
  static bool is_outside(const btSoftBody& body, const Rigid& rigid) {
    if (rigid.shape.kind == "plane") return is_on_one_side(body, rigid.body->getWorldTransform());
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

  std::vector<PenetrationCheck::Obstacle> obstacles_to_check() const {
    std::vector<PenetrationCheck::Obstacle> obstacles;
    for (const Rigid& rigid : rigid_)
      obstacles.push_back({rigid.body.get(), &rigid.shape.surface, rigid.mover || rigid.was_put});
    if (chain_) {
      for (const auto& link : chain_->links())
        obstacles.push_back({link.get(), &chain_->surface(), true});
    }
    return obstacles;
  }

  static void between_substeps(btDynamicsWorld* world, btScalar) {
    Scene& scene = *static_cast<Scene*>(world->getWorldUserInfo());
    if (scene.substep_++ > 0) scene.inspect();
    if (scene.is_over()) throw SceneIsOver();
  }
  bool is_over() const {
    return !report_.finite || report_.left_out || report_.fastest >= explosion_speed;
  }

  void restart_checks() {
    penetration_check_.restart(soft_, obstacles_to_check());
    frame_check_.restart(soft_, obstacles_to_check());
  }

  // Driven bodies are looked at after whole frames: Bullet has them at the end of the frame from
  // its first substep on, and LazyCCD moves them evenly.
  void inspect_frame() {
    if (report_.left_out) return;
    report_.overlaps += frame_check_.step().with_driven + frame_check_.intersections().with_driven;
  }

  void inspect() {
    const auto start = std::chrono::steady_clock::now();
    double fastest = 0;
    report_.finite = report_.finite && std::isfinite(kinetic_energy(&fastest));
    report_.left_out = report_.left_out || world_.has_left_out();
    if (!report_.finite || report_.left_out) return;
    report_.fastest = std::max(report_.fastest, fastest);
    const std::int64_t before = report_.crossings;
    const PenetrationCheck::Count crossed = penetration_check_.step(),
                                  intersecting = penetration_check_.intersections();
    report_.crossings += crossed.others;
    if (report_.crossings > before && report_.first_crossing < 0) report_.first_crossing = step_;
    report_.intersections = std::max(report_.intersections, intersecting.others);
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
        if (!(static_cast<double>(node.m_x.length()) < max_distance)) twice = std::nan("");
      }
    }
    for (const Rigid& rigid : rigid_) {
      if (rigid.body->isStaticOrKinematicObject()) continue;
      twice += static_cast<double>(rigid.body->getLinearVelocity().length2()) /
               static_cast<double>(rigid.body->getInvMass());
    }
    return twice / 2;
  }

  RandomSource random_;
  RandomWorld world_;

  double size_, margin_, dt_, speed_, spread_;
  bool varying_, in_real_time_ = false, deletes_ = false;
  int substeps_, substep_ = 0, step_ = 0;
  double seconds_inspecting_ = 0;
  btVector3 far_ = btVector3(0, 0, 0);
  std::vector<Rigid> rigid_;
  std::unique_ptr<Chain> chain_;
  std::unique_ptr<btTypedConstraint> joint_;
  std::vector<Driven> driven_;
  std::vector<std::unique_ptr<btSoftBody>> soft_;
  std::vector<ChangeLimits> limits_;    // of each soft body
  PenetrationCheck penetration_check_;  // of substeps
  PenetrationCheck frame_check_;
  SceneReport report_;
};

}  // namespace

SceneReport run_random_scene(std::uint32_t number, scenes::World world,
                             scenes::Collisions collisions, const bullet::SolverOptions& options,
                             const std::function<void(const SceneStep&)>& after_step) {
  return Scene(number, world, collisions, options).run(after_step);
}

}  // namespace lazyccd::test
