#include "motion/articulated_motion.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyLink.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <Eigen/Cholesky>
#include <algorithm>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A joint is at its limit if it is nearer than this fraction of its range, and than this many
// radians or metres.
constexpr btScalar near_limit = btScalar(1e-3);
// A motor exerts at most what gives the mass of the multibody this speed in a step, m/s. It may be
// far stronger. What presses light nodes against something fixed with all of that could not be
// solved.
constexpr double max_push_speed = 3;
// Of Bullet's inverse mass, relative.
constexpr double rounding = 1e-5;

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

// Of what can move, kg.
double mass_of(const btMultiBody& body) {
  btScalar mass = body.hasFixedBase() ? 0 : body.getBaseMass();
  for (int i = 0; i < body.getNumLinks(); ++i) mass += body.getLinkMass(i);
  return static_cast<double>(mass);
}

// Diagonal of the bounds of all colliders, metres.
double size_of(const btMultiBody& body) {
  btVector3 lower = body.getBasePos(), upper = lower;
  for (int i = -1; i < body.getNumLinks(); ++i) {
    const btMultiBodyLinkCollider* const collider =
        i < 0 ? body.getBaseCollider() : body.getLinkCollider(i);
    const btCollisionShape* const shape = collider ? collider->getCollisionShape() : nullptr;
    if (!shape || shape->isInfinite()) continue;
    btVector3 collider_lower, collider_upper;
    shape->getAabb(collider->getWorldTransform(), collider_lower, collider_upper);
    lower.setMin(collider_lower);
    upper.setMax(collider_upper);
  }
  return static_cast<double>((upper - lower).length());
}

// 1: the joint is at its upper limit, -1: at its lower one, 0: at none.
int limit_at(const btMultibodyLink& link, btScalar position) {
  const btScalar range = link.m_jointUpperLimit - link.m_jointLowerLimit;
  const btScalar near = near_limit * std::min(range, btScalar(1));
  if (!(near > 0)) return 0;  // there are no limits
  if (position >= link.m_jointUpperLimit - near) return 1;
  return position <= link.m_jointLowerLimit + near ? -1 : 0;
}

MatrixXd columns_of(const MatrixXd& matrix, const std::vector<Eigen::Index>& indices) {
  MatrixXd columns(matrix.rows(), static_cast<Eigen::Index>(indices.size()));
  for (std::size_t i = 0; i < indices.size(); ++i)
    columns.col(static_cast<Eigen::Index>(i)) = matrix.col(indices[i]);
  return columns;
}

MatrixXd rows_of(const MatrixXd& matrix, const std::vector<Eigen::Index>& indices) {
  return columns_of(matrix.transpose(), indices).transpose();
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
  free_inverse_mass = inverse_mass;
  find_limits();
  hold_joints();
  impulse = displacement = split_impulse = split_displacement = velocity_change = momentum_change =
      VectorXd::Zero(count);
}

void ArticulatedMotion::find_limits() {
  std::size_t place = 0;  // in MultibodyPose::joints
  for (int i = 0; i < body->getNumLinks(); ++i) {
    const btMultibodyLink& link = body->getLink(i);
    const Eigen::Index coordinate = 6 + link.m_dofOffset;
    if (link.m_dofCount == 1 && free_inverse_mass(coordinate, coordinate) > 0) {
      // A joint that has just arrived is free at first.
      const int side = limit_at(link, predicted.joints[place]);
      if (side != 0)
        holds.push_back(limit_hold(coordinate, side, limit_at(link, start.joints[place]) == side));
    }
    place += static_cast<std::size_t>(link.m_posVarCount);
  }
}

void ArticulatedMotion::set_motors(const std::vector<JointMotor>& motors, double dt) {
  holds.clear();
  find_limits();
  const double most_force = max_push_speed * mass_of(*body) * dt,
               most_torque = most_force * size_of(*body);
  for (const JointMotor& motor : motors) {
    const btMultibodyLink& link = body->getLink(motor.link);
    const Eigen::Index coordinate = 6 + link.m_dofOffset;
    if (link.m_dofCount != 1 || !(free_inverse_mass(coordinate, coordinate) > 0)) continue;
    const bool turns = link.m_jointType == btMultibodyLink::eRevolute;
    const JointHold added = motor_hold(coordinate, motor, turns ? most_torque : most_force);
    const auto place = std::lower_bound(
        holds.begin(), holds.end(), coordinate,
        [](const JointHold& hold, Eigen::Index other) { return hold.coordinate < other; });
    if (place == holds.end() || place->coordinate != coordinate) {
      holds.insert(place, added);
    } else {  // both hold the joint
      place->lowest += added.lowest;
      place->highest += added.highest;
    }
  }
  hold_joints();
}

std::vector<Eigen::Index> ArticulatedMotion::held_coordinates() const {
  std::vector<Eigen::Index> coordinates;
  for (const JointHold& hold : holds)
    if (hold.holds) coordinates.push_back(hold.coordinate);
  return coordinates;
}

// What holds coordinates exerts just the impulses that keep them: W - W_H inv(W_HH) W_H^T, with the
// inverse mass W of the free body and the columns W_H of what is held.
void ArticulatedMotion::hold_joints() {
  inverse_mass = free_inverse_mass;
  motor_impulse = VectorXd::Zero(velocity.size());
  for (const JointHold& hold : holds)
    if (!hold.holds) motor_impulse[hold.coordinate] = hold.exerted;
  const std::vector<Eigen::Index> coordinates = held_coordinates();
  if (coordinates.empty()) return;
  const MatrixXd columns = columns_of(free_inverse_mass, coordinates);
  inverse_mass -= columns * rows_of(columns, coordinates).ldlt().solve(columns.transpose());
  for (const Eigen::Index i : coordinates) {  // what rounding left
    inverse_mass.row(i).setZero();
    inverse_mass.col(i).setZero();
  }
}

VectorXd ArticulatedMotion::reactions(const VectorXd& impulses) const {
  VectorXd sum = motor_impulse;
  const std::vector<Eigen::Index> coordinates = held_coordinates();
  if (coordinates.empty()) return sum;
  const MatrixXd columns = columns_of(free_inverse_mass, coordinates);
  const VectorXd stopped =
      rows_of(columns, coordinates).ldlt().solve(columns.transpose() * (impulses + motor_impulse));
  for (std::size_t i = 0; i < coordinates.size(); ++i)
    sum[coordinates[i]] -= stopped[static_cast<Eigen::Index>(i)];
  return sum;
}

VectorXd ArticulatedMotion::with_limits(const VectorXd& impulses) const {
  VectorXd sum = impulses;
  if (std::none_of(holds.begin(), holds.end(),
                   [](const JointHold& hold) { return hold.is_limit && hold.holds; }))
    return sum;
  const VectorXd exerted = reactions(impulses);
  for (const JointHold& hold : holds)
    if (hold.is_limit && hold.holds) sum[hold.coordinate] += exerted[hold.coordinate];
  return sum;
}

// Split impulses restore gaps, so they are no forces that a motor would have to resist.
std::vector<ArticulatedMotion::Fitted> ArticulatedMotion::fitted_holds() const {
  std::vector<Fitted> fitted;
  if (holds.empty()) return fitted;
  const VectorXd pushed = impulse + split_impulse, moved = displacement + split_displacement;
  const VectorXd limit_reactions = reactions(pushed),
                 motor_reactions = has_motors() ? reactions(impulse) : limit_reactions;
  for (const JointHold& hold : holds) {
    const Eigen::Index i = hold.coordinate;
    JointHold::Load load;
    load.reaction = (hold.is_limit ? limit_reactions : motor_reactions)[i];
    load.moved = (hold.is_limit ? moved : displacement)[i];
    load.mobility = inverse_mass(i, i);
    load.reaction_tolerance = rounding * pushed.lpNorm<Eigen::Infinity>();
    load.moved_tolerance = rounding * moved.lpNorm<Eigen::Infinity>();
    fitted.push_back({hold.fitted_to(load), hold.holds && hold.is_beyond(load.reaction)});
  }
  return fitted;
}

std::vector<JointHold> ArticulatedMotion::next_holds() const {
  std::vector<JointHold> next;
  for (const Fitted& fitted : fitted_holds()) next.push_back(fitted.hold);
  return next;
}

bool ArticulatedMotion::has_motors() const {
  return std::any_of(holds.begin(), holds.end(),
                     [](const JointHold& hold) { return !hold.is_limit; });
}

ArticulatedMotion::Changes ArticulatedMotion::update_holds(Update update, bool is_final) {
  Changes changes;
  const std::vector<Fitted> fitted = fitted_holds();
  for (std::size_t i = 0; i < fitted.size(); ++i) {
    JointHold to = fitted[i].hold;
    if (to.is_same_state(holds[i])) continue;
    if (update != Update::all && to.is_limit && (update != Update::last || !to.holds)) continue;
    if (!to.is_limit && (is_final || (update != Update::all && !holds[i].holds)))
      to.set_state(MotorState::idle);
    if (to.is_same_state(holds[i])) continue;
    holds[i] = to;
    changes.include({true, fitted[i].is_beyond});
  }
  if (changes.any) hold_joints();
  return changes;
}

void ArticulatedMotion::stop_motors() {
  for (JointHold& hold : holds) hold.exerted = 0;
  motor_impulse.setZero();
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
