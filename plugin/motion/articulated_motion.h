// Multibodies (articulated bodies) over one step, in the generalized coordinates of btMultiBody:
// angular and linear velocity of the base, then the velocities of the joints.
//
// Contacts act on links. An impulse on one link moves all links, as the joints let them. Bullet's
// articulated body algorithm (btMultiBody::calcAccelerationDeltasMultiDof; Featherstone 2008,
// "Rigid Body Dynamics Algorithms", section 7.3) gives the response to an impulse.
//
// Bullet solves limits and motors of joints before contacts are found. So what holds a joint
// (joint_hold.h) acts here again. A joint that is at its limit does not give way beyond it: Bullet
// would bring it back slowly, or not at all with split impulses. Limits are those of
// btMultibodyLink, as loaders of URDF files set them. A motor holds its joint as far as its largest
// impulse allows. Otherwise contacts would push a light foot aside, and what stands on it sinks.
#pragma once

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <LinearMath/btTransform.h>

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "motion/joint_hold.h"
#include "util/dense.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Pose of the base and positions of all joints of a multibody.
struct MultibodyPose {
  btVector3 base_position;
  btQuaternion world_to_base;
  std::vector<btScalar> joints;
};

MultibodyPose pose_of(const btMultiBody& body);
/// Sets the pose, and with it the world transforms of all links.
void set_pose(btMultiBody& body, const MultibodyPose& pose);
/// Sets the pose that the body reaches from `pose` by a generalized displacement (metres, radians),
/// as btMultiBody integrates velocities. Velocities stay as they are.
void set_pose(btMultiBody& body, const MultibodyPose& pose, const DenseVector& displacement);

/// True if a free base or a joint moves the link; -1 is the base. False if the link is fixed to a
/// base that nothing moves.
bool is_moved(const btMultiBody& body, int link);

/// Motion of a multibody over the step. Only links near soft bodies are listed.
struct ArticulatedMotion {
  struct Link {
    int rigid;  ///< index in Motion::rigid
    /// Linear velocity of the centre of mass and angular velocity (6 rows), by generalized
    /// coordinate.
    DenseMatrix jacobian;
  };

  /// What update_holds() may change.
  enum class Update {
    all,
    /// No limit lets go of a joint. Motors only get weaker: one that holds exerts its bound, and
    /// one that then moves its joint against the contacts exerts nothing.
    last,
    /// As the last one, and limits stay as they are.
    weaken_motors
  };
  /// What update_holds() changed.
  struct Changes {
    bool any = false;
    bool any_beyond = false;  ///< JointHold::is_beyond() of a motor that lets go
    void include(const Changes& other) {
      any = any || other.any;
      any_beyond = any_beyond || other.any_beyond;
    }
  };

  btMultiBody* body;
  MultibodyPose start, predicted;  ///< at the start of the step; Bullet's at its end
  DenseVector velocity;            ///< Bullet's, at the end of the step
  DenseMatrix inverse_mass;        ///< generalized; zero for joints that are held
  DenseMatrix free_inverse_mass;   ///< if no joint is held
  std::vector<Link> links;
  std::vector<JointHold> holds;  ///< joints at their limits or with motors, by coordinate
  /// Generalized impulse of motors that exert what they can and do not hold their joints, kg m and
  /// kg m^2.
  DenseVector motor_impulse;

  /// What the response adds. Impulses are generalized, in kg m and kg m^2 (as ContactRow has them).
  DenseVector impulse, displacement, split_impulse, split_displacement;
  /// Changes of velocity that the displacement makes. Generalized momentum that contacts and limits
  /// give; that of motors is left out, as their work is no gain of energy by contacts.
  DenseVector velocity_change, momentum_change;
  bool held = false;  ///< the body stays at `start`

  /// Reads mass, velocity and pose from Bullet, without links.
  ArticulatedMotion(btMultiBody& multibody, const MultibodyPose& start_pose);
  /// Adds link `index` of the multibody; -1 is its base. `centre`: its centre of mass, metres.
  void add_link(int index, int rigid, const btVector3& centre);
  /// Replaces the motors. Joints are held as at the start of a step of `dt` seconds.
  void set_motors(const std::vector<JointMotor>& motors, double dt);
  /// Resets the response. Bullet's body gets its predicted pose again. What holds stays.
  void restart_response();
  /// Changes the holds that do not fit to the impulses and displacements of the response. If there
  /// are any, contacts must be solved again. `is_final`: a motor that gives way exerts nothing,
  /// because no update follows that would check its bound.
  Changes update_holds(Update update, bool is_final = false);
  bool has_motors() const;
  /// Of each hold: the one that fits to the response, with which the next step begins.
  std::vector<JointHold> next_holds() const;
  /// The generalized momentum that contacts with these impulses give, with what limits exert.
  DenseVector with_limits(const DenseVector& impulses) const;
  /// The generalized impulse that limits and motors exert if contacts have these impulses.
  DenseVector reactions(const DenseVector& impulses) const;
  /// Whether motors exert what they can.
  bool has_motor_impulse() const;
  /// Motion of each link that motor_impulse makes.
  std::vector<Vector6d> motor_displacements() const;
  /// Takes motor_impulse away.
  void stop_motors();
  /// Adds an impulse and an angular impulse on the centre of a link to `impulse` or, if `split`, to
  /// `split_impulse`.
  void add_impulse(const Link& link, const Vector6d& on_link, bool split);
  void clear_impulse(bool split);
  /// Sets `displacement` or `split_displacement` to what the impulses make, with the motors.
  void set_displacement(bool split);
  /// The part of that displacement that is the motion of a link.
  Vector6d displacement_of(const Link& link, bool split) const;
  /// Sets the changes of velocity and momentum from displacement and impulse in a step of `dt`.
  void set_velocity_change(double dt);
  /// Adds to them those of another response, `fraction` times.
  void add_velocity_change(const ArticulatedMotion& other, double fraction, double dt);
  void scale_velocity_change(double factor);
  /// Whether impulses act or anything moves, without split impulses.
  bool is_pushed() const;
  /// Gives Bullet's body the pose at the end of the step, with the response.
  void set_end_pose() const;
  /// True if the response changes pose or velocity.
  bool is_changed() const;
  /// Rise of the kinetic energy by the velocity change, joules.
  double energy_change() const;
  /// The part of that which is linear in the change, and twice the quadratic part, joules.
  double mixed_energy() const;
  double quadratic_energy() const;
  /// Response of link `b` to an impulse and an angular impulse on the centre of link `a`.
  Matrix6d mobility(const Link& a, const Link& b) const;
  /// RigidTerm::mobility() of a link, 1/kg, if no joint is held. `weight`, `arm`: those of the
  /// term.
  Matrix3d free_mobility_of(const Link& link, double weight, const Vector3d& arm) const;
  const Link& link_of(int rigid) const;

 private:
  void find_limits();
  /// Sets inverse_mass and motor_impulse for what holds.
  void hold_joints();
  /// Coordinates of joints that are held.
  std::vector<std::size_t> held_coordinates() const;
  /// What holds a joint, with its state, is fitted to the response.
  struct Fitted {
    JointHold hold;
    bool is_beyond;
  };
  std::vector<Fitted> fitted_holds() const;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
