// Multibodies (articulated bodies) over one step, in the generalized coordinates of btMultiBody:
// angular and linear velocity of the base, then the velocities of the joints.
//
// Contacts act on links. An impulse on one link moves all links, as the joints let them. Bullet's
// articulated body algorithm (btMultiBody::calcAccelerationDeltasMultiDof; Featherstone 2008,
// "Rigid Body Dynamics Algorithms", section 7.3) gives the response to an impulse.
//
// A joint that is at its limit does not give way beyond it. Bullet solves limits before contacts
// are found, and brings a joint that is beyond its limit back slowly, or not at all with split
// impulses. So contacts may not push it there. Limits are those of btMultibodyLink, as loaders of
// URDF files set them. Motors are not known here.
#pragma once

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <LinearMath/btTransform.h>

#include <Eigen/Core>
#include <vector>

#include "lazyccd/bullet/precision.h"

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
void set_pose(btMultiBody& body, const MultibodyPose& pose, const Eigen::VectorXd& displacement);

/// True if a free base or a joint moves the link; -1 is the base. False if the link is fixed to a
/// base that nothing moves.
bool is_moved(const btMultiBody& body, int link);

/// Motion of a multibody over the step. Only links near soft bodies are listed.
struct ArticulatedMotion {
  using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic>;
  struct Link {
    int rigid;  ///< index in Motion::rigid
    /// Linear velocity of the centre of mass and angular velocity, by generalized coordinate.
    Jacobian jacobian;
  };

  /// A joint with one coordinate that is at its limit at the end of Bullet's step.
  struct JointLimit {
    Eigen::Index coordinate;
    int side;    ///< 1: the upper limit, -1: the lower one
    bool holds;  ///< contacts do not move the joint
  };

  btMultiBody* body;
  MultibodyPose start, predicted;     ///< at the start of the step; Bullet's at its end
  Eigen::VectorXd velocity;           ///< Bullet's, at the end of the step
  Eigen::MatrixXd inverse_mass;       ///< generalized; zero for joints that limits hold
  Eigen::MatrixXd free_inverse_mass;  ///< without limits
  std::vector<Link> links;
  std::vector<JointLimit> limits;

  /// What the response adds. Impulses are generalized, in kg m and kg m^2 (as ContactRow has them).
  Eigen::VectorXd impulse, displacement, split_impulse, split_displacement;
  /// Changes that the displacement makes, and the generalized momentum that belongs to them.
  Eigen::VectorXd velocity_change, momentum_change;
  bool held = false;  ///< the body stays at `start`

  /// Reads mass, velocity and pose from Bullet, without links.
  ArticulatedMotion(btMultiBody& multibody, const MultibodyPose& start_pose);
  /// Adds link `index` of the multibody; -1 is its base. `centre`: its centre of mass, metres.
  void add_link(int index, int rigid, const btVector3& centre);
  /// Resets the response. Bullet's body gets its predicted pose again. Limits hold as before.
  void restart_response();
  /// Lets limits hold where the displacements are beyond them, and, with `may_free`, frees joints
  /// that the impulses push away from their limits. Returns whether there are any. Then contacts
  /// must be solved again.
  bool update_limits(bool may_free);
  /// The generalized momentum that contacts with these impulses give, with what limits exert.
  Eigen::VectorXd with_limits(const Eigen::VectorXd& impulses) const;
  /// Gives Bullet's body the pose at the end of the step, with the response.
  void set_end_pose() const;
  /// True if the response changes pose or velocity.
  bool is_changed() const;
  /// Rise of the kinetic energy by the velocity change, joules.
  double energy_change() const { return momentum_change.dot(velocity + 0.5 * velocity_change); }
  /// Response of link `b` to an impulse and an angular impulse on the centre of link `a`.
  Eigen::Matrix<double, 6, 6> mobility(const Link& a, const Link& b) const {
    return b.jacobian * inverse_mass * a.jacobian.transpose();
  }
  const Link& link_of(int rigid) const;

 private:
  void find_limits();
  /// Sets inverse_mass for the limits that hold.
  void hold_at_limits();
  /// Coordinates of joints that limits hold.
  std::vector<Eigen::Index> held_coordinates() const;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
