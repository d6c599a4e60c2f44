#include "motion/articulated_motion.h"

#include <BulletDynamics/Featherstone/btMultiBodyLink.h>

#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::VectorXd;

// Moves the colliders of all links to where the joints have them.
void update_links(btMultiBody& body) {
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> origins;
  body.forwardKinematics(rotations, origins);
  body.updateCollisionObjectWorldTransforms(rotations, origins);
}

// Sets base and joints, and leaves the links where they are.
void set_coordinates(btMultiBody& body, const MultibodyPose& pose) {
  body.setBasePos(pose.base_position);
  body.setWorldToBaseRot(pose.world_to_base);
  const btScalar* joint = pose.joints.data();
  for (int i = 0; i < body.getNumLinks(); ++i) {
    body.setJointPosMultiDof(i, joint);
    joint += body.getLink(i).m_posVarCount;
  }
}

std::vector<btScalar> velocities_of(const btMultiBody& body) {
  const btScalar* const first = body.getVelocityVector();
  return {first, first + 6 + body.getNumDofs()};
}

void set_velocities(btMultiBody& body, const btScalar* v) {
  body.setBaseOmega(btVector3(v[0], v[1], v[2]));
  body.setBaseVel(btVector3(v[3], v[4], v[5]));
  v += 6;
  for (int i = 0; i < body.getNumLinks(); ++i) {
    body.setJointVelMultiDof(i, v);
    v += body.getLink(i).m_dofCount;
  }
}

}  // namespace

MultibodyPose pose_of(const btMultiBody& body) {
  MultibodyPose pose{body.getBasePos(), body.getWorldToBaseRot(), {}};
  for (int i = 0; i < body.getNumLinks(); ++i) {
    const btScalar* const first = body.getJointPosMultiDof(i);
    pose.joints.insert(pose.joints.end(), first, first + body.getLink(i).m_posVarCount);
  }
  return pose;
}

void set_pose(btMultiBody& body, const MultibodyPose& pose) {
  set_coordinates(body, pose);
  update_links(body);
}

void set_pose(btMultiBody& body, const MultibodyPose& pose, const VectorXd& displacement) {
  set_coordinates(body, pose);
  // stepPositionsMultiDof() can take other velocities as arguments, but not those of planar joints.
  const std::vector<btScalar> velocities = velocities_of(body);
  std::vector<btScalar> moved(velocities.size());
  std::transform(displacement.begin(), displacement.end(), moved.begin(),
                 [](double x) { return static_cast<btScalar>(x); });
  set_velocities(body, moved.data());
  body.stepPositionsMultiDof(1);
  set_velocities(body, velocities.data());
  update_links(body);
}

bool is_moved(const btMultiBody& body, int link) {
  for (; link >= 0; link = body.getLink(link).m_parent) {
    if (body.getLink(link).m_dofCount > 0) return true;
  }
  return !body.hasFixedBase() && !body.isBaseStaticOrKinematic();
}

ArticulatedMotion::ArticulatedMotion(btMultiBody& multibody, const MultibodyPose& start_pose)
    : body(&multibody), start(start_pose), predicted(pose_of(multibody)) {
  const std::vector<btScalar> velocities = velocities_of(multibody);
  const auto count = static_cast<Eigen::Index>(velocities.size());
  velocity.resize(count);
  std::copy(velocities.begin(), velocities.end(), velocity.begin());
  inverse_mass.resize(count, count);
  btAlignedObjectArray<btScalar> scratch;
  btAlignedObjectArray<btVector3> scratch_vectors;
  std::vector<btScalar> force(velocities.size(), 0), acceleration(velocities.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    force[static_cast<std::size_t>(i)] = 1;
    multibody.calcAccelerationDeltasMultiDof(force.data(), acceleration.data(), scratch,
                                             scratch_vectors);
    force[static_cast<std::size_t>(i)] = 0;
    std::copy(acceleration.begin(), acceleration.end(), inverse_mass.col(i).begin());
  }
  // A base that does not move has no coordinates that an impulse can change.
  if (multibody.hasFixedBase() || multibody.isBaseStaticOrKinematic()) {
    inverse_mass.topRows(6).setZero();
    inverse_mass.leftCols(6).setZero();
  }
  inverse_mass = (0.5 * (inverse_mass + inverse_mass.transpose())).eval();
  impulse = displacement = split_impulse = split_displacement = velocity_change = momentum_change =
      VectorXd::Zero(count);
}

void ArticulatedMotion::add_link(int index, int rigid, const btVector3& centre) {
  Link link{rigid, Jacobian(6, velocity.size())};
  btAlignedObjectArray<btScalar> scratch;
  btAlignedObjectArray<btVector3> scratch_vectors;
  btAlignedObjectArray<btMatrix3x3> scratch_matrices;
  std::vector<btScalar> row(static_cast<std::size_t>(velocity.size()));
  const btVector3 none(0, 0, 0);
  for (int k = 0; k < 6; ++k) {
    btVector3 axis = none;
    axis[k % 3] = 1;
    body->fillConstraintJacobianMultiDof(index, centre, k < 3 ? none : axis, k < 3 ? axis : none,
                                         row.data(), scratch, scratch_vectors, scratch_matrices);
    std::copy(row.begin(), row.end(), link.jacobian.row(k).begin());
  }
  links.push_back(std::move(link));
}

void ArticulatedMotion::restart_response() {
  const bool is_elsewhere = held || !displacement.isZero(0) || !split_displacement.isZero(0);
  for (VectorXd* const x : {&impulse, &displacement, &split_impulse, &split_displacement,
                            &velocity_change, &momentum_change})
    x->setZero();
  held = false;
  if (is_elsewhere) set_pose(*body, predicted);
}

void ArticulatedMotion::set_end_pose() const {
  if (held) {
    set_pose(*body, start);
  } else {
    set_pose(*body, predicted, displacement + split_displacement);
  }
}

bool ArticulatedMotion::is_changed() const {
  return held || !velocity_change.isZero(0) || !displacement.isZero(0) ||
         !split_displacement.isZero(0);
}

const ArticulatedMotion::Link& ArticulatedMotion::link_of(int rigid) const {
  return *std::find_if(links.begin(), links.end(),
                       [rigid](const Link& link) { return link.rigid == rigid; });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
