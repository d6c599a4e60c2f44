#include "motion/articulated_motion.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyLink.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <numeric>

#include "settings.h"
#include "util/decompositions.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

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
  const btScalar near = btScalar(settings::joints::near_limit) * std::min(range, btScalar(1));
  if (!(near > 0)) return 0;  // there are no limits
  if (position >= link.m_jointUpperLimit - near) return 1;
  return position <= link.m_jointLowerLimit + near ? -1 : 0;
}

// The elements of a matrix in the given rows and columns.
DenseMatrix part_of(const DenseMatrix& matrix, const std::vector<std::size_t>& rows,
                    const std::vector<std::size_t>& columns) {
  DenseMatrix part(rows.size(), columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k) {
    for (std::size_t i = 0; i < rows.size(); ++i) part(i, k) = matrix(rows[i], columns[k]);
  }
  return part;
}

std::vector<std::size_t> all_of(const DenseVector& coordinates) {
  std::vector<std::size_t> all(coordinates.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return all;
}

// Column of a matrix with six rows.
Vector6d column_of(const DenseMatrix& jacobian, std::size_t k) {
  Vector6d column;
  std::copy_n(jacobian.data() + 6 * k, 6, column.data());
  return column;
}

Vector6d fixed(const DenseVector& x) {
  Vector6d result;
  std::copy_n(x.data(), 6, result.data());
  return result;
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

void set_pose(btMultiBody& body, const MultibodyPose& pose, const DenseVector& displacement) {
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
  const std::size_t count = velocities.size();
  velocity = DenseVector(velocities.begin(), velocities.end());
  DenseMatrix response(count, count);
  btAlignedObjectArray<btScalar> scratch;
  btAlignedObjectArray<btVector3> scratch_vectors;
  std::vector<btScalar> force(count, 0), acceleration(count);
  for (std::size_t i = 0; i < count; ++i) {
    force[i] = 1;
    multibody.calcAccelerationDeltasMultiDof(force.data(), acceleration.data(), scratch,
                                             scratch_vectors);
    force[i] = 0;
    for (std::size_t k = 0; k < count; ++k) response(k, i) = static_cast<double>(acceleration[k]);
  }
  // A base that does not move has no coordinates that an impulse can change.
  const bool is_base_fixed = multibody.hasFixedBase() || multibody.isBaseStaticOrKinematic();
  inverse_mass = DenseMatrix(count, count);
  for (std::size_t i = is_base_fixed ? 6 : 0; i < count; ++i) {
    for (std::size_t k = is_base_fixed ? 6 : 0; k < count; ++k)
      inverse_mass(i, k) = 0.5 * (response(i, k) + response(k, i));
  }
  free_inverse_mass = inverse_mass;
  find_limits();
  hold_joints();
  impulse = displacement = split_impulse = split_displacement = velocity_change = momentum_change =
      DenseVector(count);
}

void ArticulatedMotion::find_limits() {
  std::size_t place = 0;  // in MultibodyPose::joints
  for (int i = 0; i < body->getNumLinks(); ++i) {
    const btMultibodyLink& link = body->getLink(i);
    const std::size_t coordinate = 6 + static_cast<std::size_t>(link.m_dofOffset);
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
  const double most_force = settings::joints::max_push_speed * mass_of(*body) * dt,
               most_torque = most_force * size_of(*body);
  for (const JointMotor& motor : motors) {
    const btMultibodyLink& link = body->getLink(motor.link);
    const std::size_t coordinate = 6 + static_cast<std::size_t>(link.m_dofOffset);
    if (link.m_dofCount != 1 || !(free_inverse_mass(coordinate, coordinate) > 0)) continue;
    const bool turns = link.m_jointType == btMultibodyLink::eRevolute;
    const JointHold added = motor_hold(coordinate, motor, turns ? most_torque : most_force);
    const auto place = std::lower_bound(
        holds.begin(), holds.end(), coordinate,
        [](const JointHold& hold, std::size_t other) { return hold.coordinate < other; });
    if (place == holds.end() || place->coordinate != coordinate) {
      holds.insert(place, added);
    } else {  // both hold the joint
      place->lowest += added.lowest;
      place->highest += added.highest;
    }
  }
  hold_joints();
}

std::vector<std::size_t> ArticulatedMotion::held_coordinates() const {
  std::vector<std::size_t> coordinates;
  for (const JointHold& hold : holds)
    if (hold.holds) coordinates.push_back(hold.coordinate);
  return coordinates;
}

// What holds coordinates exerts just the impulses that keep them: W - W_H inv(W_HH) W_H^T, with the
// inverse mass W of the free body and the columns W_H of what is held.
void ArticulatedMotion::hold_joints() {
  inverse_mass = free_inverse_mass;
  motor_impulse = DenseVector(velocity.size());
  for (const JointHold& hold : holds)
    if (!hold.holds) motor_impulse[hold.coordinate] = hold.exerted;
  const std::vector<std::size_t> coordinates = held_coordinates();
  if (coordinates.empty()) return;
  DenseMatrix impulses = part_of(free_inverse_mass, coordinates, all_of(velocity));
  solve_symmetric(part_of(free_inverse_mass, coordinates, coordinates), impulses);
  for (std::size_t k = 0; k < velocity.size(); ++k) {
    for (std::size_t i = 0; i < velocity.size(); ++i) {
      for (std::size_t h = 0; h < coordinates.size(); ++h)
        inverse_mass(i, k) -= free_inverse_mass(i, coordinates[h]) * impulses(h, k);
    }
  }
  for (const std::size_t i : coordinates) {  // what rounding left
    for (std::size_t k = 0; k < velocity.size(); ++k) inverse_mass(i, k) = inverse_mass(k, i) = 0;
  }
}

DenseVector ArticulatedMotion::reactions(const DenseVector& impulses) const {
  DenseVector sum = motor_impulse;
  const std::vector<std::size_t> coordinates = held_coordinates();
  if (coordinates.empty()) return sum;
  const DenseVector moved =
      part_of(free_inverse_mass, coordinates, all_of(velocity)) * (impulses + motor_impulse);
  const DenseVector stopped =
      solve_symmetric(part_of(free_inverse_mass, coordinates, coordinates), moved);
  for (std::size_t i = 0; i < coordinates.size(); ++i) sum[coordinates[i]] -= stopped[i];
  return sum;
}

DenseVector ArticulatedMotion::with_limits(const DenseVector& impulses) const {
  DenseVector sum = impulses;
  if (std::none_of(holds.begin(), holds.end(),
                   [](const JointHold& hold) { return hold.is_limit && hold.holds; }))
    return sum;
  const DenseVector exerted = reactions(impulses);
  for (const JointHold& hold : holds)
    if (hold.is_limit && hold.holds) sum[hold.coordinate] += exerted[hold.coordinate];
  return sum;
}

// Split impulses restore gaps, so they are no forces that a motor would have to resist.
std::vector<ArticulatedMotion::Fitted> ArticulatedMotion::fitted_holds() const {
  std::vector<Fitted> fitted;
  if (holds.empty()) return fitted;
  const DenseVector pushed = impulse + split_impulse, moved = displacement + split_displacement;
  const DenseVector limit_reactions = reactions(pushed),
                    motor_reactions = has_motors() ? reactions(impulse) : limit_reactions;
  for (const JointHold& hold : holds) {
    const std::size_t i = hold.coordinate;
    JointHold::Load load;
    load.reaction = (hold.is_limit ? limit_reactions : motor_reactions)[i];
    load.moved = (hold.is_limit ? moved : displacement)[i];
    load.mobility = inverse_mass(i, i);
    load.reaction_tolerance = rounding * pushed.norm_infinity();
    load.moved_tolerance = rounding * moved.norm_infinity();
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

bool ArticulatedMotion::has_motor_impulse() const { return !motor_impulse.isZero(); }

std::vector<Vector6d> ArticulatedMotion::motor_displacements() const {
  const DenseVector moved = inverse_mass * motor_impulse;
  std::vector<Vector6d> of_links;
  for (const Link& link : links) of_links.push_back(fixed(link.jacobian * moved));
  return of_links;
}

void ArticulatedMotion::add_impulse(const Link& link, const Vector6d& on_link, bool split) {
  DenseVector& sum = split ? split_impulse : impulse;
  for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += column_of(link.jacobian, k).dot(on_link);
}

void ArticulatedMotion::clear_impulse(bool split) { (split ? split_impulse : impulse).setZero(); }

void ArticulatedMotion::set_displacement(bool split) {
  DenseVector& moved = split ? split_displacement : displacement;
  moved = inverse_mass * (split ? split_impulse : impulse);
  if (!split && has_motor_impulse()) moved += inverse_mass * motor_impulse;
}

Vector6d ArticulatedMotion::displacement_of(const Link& link, bool split) const {
  return fixed(link.jacobian * (split ? split_displacement : displacement));
}

void ArticulatedMotion::set_velocity_change(double dt) {
  velocity_change = displacement / dt;
  momentum_change = with_limits(impulse) / dt;
}

void ArticulatedMotion::add_velocity_change(const ArticulatedMotion& other, double fraction,
                                            double dt) {
  velocity_change += fraction / dt * other.displacement;
  momentum_change += fraction / dt * other.with_limits(other.impulse);
}

void ArticulatedMotion::scale_velocity_change(double factor) {
  velocity_change *= factor;
  momentum_change *= factor;
}

bool ArticulatedMotion::is_pushed() const { return !impulse.isZero() || !displacement.isZero(); }

double ArticulatedMotion::energy_change() const {
  return momentum_change.dot(velocity + 0.5 * velocity_change);
}

double ArticulatedMotion::mixed_energy() const { return momentum_change.dot(velocity); }

double ArticulatedMotion::quadratic_energy() const { return momentum_change.dot(velocity_change); }

Matrix6d ArticulatedMotion::mobility(const Link& a, const Link& b) const {
  Matrix6d result;
  for (std::size_t k = 0; k < 6; ++k)
    result.set_col(static_cast<int>(k), fixed(b.jacobian * (inverse_mass * a.jacobian.row(k))));
  return result;
}

Matrix3d ArticulatedMotion::free_mobility_of(const Link& link, double weight,
                                             const Vector3d& arm) const {
  Matrix3d result;
  DenseVector pushed(velocity.size());
  for (int k = 0; k < 3; ++k) {
    const Vector3d push = Vector3d::Unit(k);
    const Vector6d on_link = stacked(weight * push, arm.cross(push));
    for (std::size_t i = 0; i < pushed.size(); ++i)
      pushed[i] = column_of(link.jacobian, i).dot(on_link);
    const Vector6d moved = fixed(link.jacobian * (free_inverse_mass * pushed));
    result.set_col(k, weight * moved.head<3>() + moved.tail<3>().cross(arm));
  }
  return result;
}

void ArticulatedMotion::add_link(int index, int rigid, const btVector3& centre) {
  Link link{rigid, DenseMatrix(6, velocity.size())};
  btAlignedObjectArray<btScalar> scratch;
  btAlignedObjectArray<btVector3> scratch_vectors;
  btAlignedObjectArray<btMatrix3x3> scratch_matrices;
  std::vector<btScalar> row(velocity.size());
  const btVector3 none(0, 0, 0);
  for (int k = 0; k < 6; ++k) {
    btVector3 axis = none;
    axis[k % 3] = 1;
    body->fillConstraintJacobianMultiDof(index, centre, k < 3 ? none : axis, k < 3 ? axis : none,
                                         row.data(), scratch, scratch_vectors, scratch_matrices);
    for (std::size_t i = 0; i < row.size(); ++i)
      link.jacobian(static_cast<std::size_t>(k), i) = static_cast<double>(row[i]);
  }
  links.push_back(std::move(link));
}

void ArticulatedMotion::restart_response() {
  const bool is_elsewhere = held || !displacement.isZero() || !split_displacement.isZero();
  for (DenseVector* const x : {&impulse, &displacement, &split_impulse, &split_displacement,
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
  return held || !velocity_change.isZero() || !displacement.isZero() ||
         !split_displacement.isZero();
}

const ArticulatedMotion::Link& ArticulatedMotion::link_of(int rigid) const {
  return *std::find_if(links.begin(), links.end(),
                       [rigid](const Link& link) { return link.rigid == rigid; });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
