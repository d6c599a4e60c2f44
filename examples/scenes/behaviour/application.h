// A Bullet application as a user writes it: its world, its bodies, its callbacks, and frames of
// 1/60 s. Bullet alone and LazyCCD differ only in the soft-body solver that the world gets.
#pragma once

#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btDeformableLagrangianForce.h>
#include <BulletSoftBody/btSoftBody.h>

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scenes/behaviour/multibody.h"
#include "scenes/worlds/physics_world.h"

namespace lazyccd::scenes::behaviour {

constexpr double frame_seconds = 1.0 / 60;

inline btScalar scalar(double x) { return static_cast<btScalar>(x); }

struct Settings {
  /// World::rigid: btSoftMultiBodyDynamicsWorld; deformable: btDeformableMultiBodyDynamicsWorld.
  World world = World::rigid;
  Collisions collisions = Collisions::lazyccd;
  int substeps = 1;                  // of a frame, >= 1
  double gravity = 9.8;              // m/s^2, downwards (-y)
  bool threaded_dispatcher = false;  // true: btCollisionDispatcherMt
  bullet::SolverOptions lazyccd;
};

/// When a function of the application runs.
enum class Moment {
  between_steps,  // before stepSimulation(), once a frame
  before_tick,    // in the pre-tick callback, each substep
  after_tick,     // in the tick callback, each substep
  in_solver       // deformable world: in the solver callback, each substep
};

/// What a user can see of a body that is not soft: a rigid body or the collider of a link.
struct Solid {
  btCollisionObject* object;
  std::optional<Triangles> surface;  // in the object's frame; empty: the counters leave it out
};

/// A number that a scene is judged by.
struct Figure {
  std::string name;  // with its unit
  double value = 0;
  /// The value is right if it is between these two.
  double at_least = -std::numeric_limits<double>::infinity();
  double at_most = std::numeric_limits<double>::infinity();
  /// If given: the value is right if it differs from Bullet alone by at most this fraction of it.
  std::optional<double> as_bullet = {};
};

/// A world, what is in it, and what the application does with it. Owns everything.
class Application {
 public:
  explicit Application(const Settings& settings);
  ~Application();
  Application(const Application&) = delete;
  Application& operator=(const Application&) = delete;

  const Settings& settings() const { return settings_; }
  bool is_rigid() const { return settings_.world == World::rigid; }
  btMultiBodyDynamicsWorld& world() { return *world_; }
  btSoftBodyWorldInfo& info();
  btDispatcher& dispatcher();

  /// Adds a soft body with the flags of a user who wants all collisions, and springs in the
  /// deformable world. `margin` in metres, `stiffness` of a spring in N/m.
  btSoftBody* add(std::unique_ptr<btSoftBody> body, double margin = 0.01, double stiffness = 2);
  /// Adds a soft body whose flags and forces the caller has set. Gravity acts on it.
  btSoftBody* add_as_is(std::unique_ptr<btSoftBody> body, double margin = 0.01);
  /// Adds a body of tetrahedra. The deformable world makes it an elastic solid with these moduli,
  /// Pa, and integrates implicitly; the rigid world has only its links.
  btSoftBody* add_solid(std::unique_ptr<btSoftBody> body, double modulus, double margin = 0.01);
  /// Adds a force of the deformable world.
  void add_force(btSoftBody* body, std::unique_ptr<btDeformableLagrangianForce> force);
  /// Adds a rigid body; mass 0: static. Boxes, meshes and spheres are counted.
  btRigidBody* add(std::unique_ptr<btCollisionShape> shape, const btTransform& pose,
                   double mass = 0, double friction = 0.5);
  /// Adds a kinematic body, which follows its motion state.
  btRigidBody* add_kinematic(std::unique_ptr<btCollisionShape> shape, const btTransform& pose);
  Multibody* add(std::unique_ptr<Multibody> body);
  /// Holds the centre of a dynamic body where it is; it may turn.
  void hold(btRigidBody* body);
  /// Leaves a body out of the counters, because the application lets soft bodies pass it.
  void do_not_count(const btCollisionObject* body);

  /// Registers a function of the application, which gets the time in seconds.
  void call(Moment moment, std::function<void(double time)> function);
  /// Runs a function once, at the first frame at or after this time.
  void call_at(double seconds, std::function<void()> function);
  /// Says that something was put elsewhere: the counters do not sweep it.
  void jumped() { jumped_ = true; }

  /// Runs a frame. `after_step` is called when each substep is complete.
  void frame(const std::function<void()>& after_step);
  double time() const { return time_; }
  bool take_jump();

  const std::vector<std::unique_ptr<btSoftBody>>& soft_bodies() const { return soft_bodies_; }
  const std::vector<Solid>& solids() const { return solids_; }
  const std::vector<std::unique_ptr<btRigidBody>>& rigid_bodies() const { return rigid_bodies_; }
  const std::vector<std::unique_ptr<Multibody>>& multibodies() const { return multibodies_; }

  // Nothing without LazyCCD.
  const bullet::StepStats* total_stats() const;
  Span<const bullet::StepContact> contacts() const;
  std::string status() const;

 private:
  struct Parts;
  void run(Moment moment);

  Settings settings_;
  std::unique_ptr<Parts> parts_;
  btMultiBodyDynamicsWorld* world_ = nullptr;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btMotionState>> motions_;
  std::vector<std::unique_ptr<btSoftBody>> soft_bodies_;
  std::vector<std::unique_ptr<btRigidBody>> rigid_bodies_;
  std::vector<std::unique_ptr<Multibody>> multibodies_;
  std::vector<Solid> solids_;
  std::vector<std::unique_ptr<btDeformableLagrangianForce>> forces_;
  std::vector<std::unique_ptr<btTypedConstraint>> constraints_;
  std::vector<std::pair<Moment, std::function<void(double)>>> functions_;
  std::function<void()> after_step_;
  double time_ = 0;
  int substep_ = 0;  // of the frame
  bool jumped_ = false;
};

}  // namespace lazyccd::scenes::behaviour
