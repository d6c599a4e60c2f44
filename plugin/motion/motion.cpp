#include "motion/motion.h"

#include <BulletCollision/CollisionDispatch/btCollisionObject.h>

#include <algorithm>
#include <cmath>

#include "lazyccd/debug/assert.h"
#include "motion/articulated_motion.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

void write_vertices(const RigidMotion& body, const btVector3* local, const btTransform& pose,
                    std::vector<btScalar>& positions) {
  btScalar* p = positions.data() + 3 * static_cast<std::size_t>(body.first_vertex);
  for (std::int32_t i = 0; i < body.vertex_count; ++i) {
    const btVector3 x = pose * local[i];
    for (int k = 0; k < 3; ++k) *p++ = x[k];
  }
}

}  // namespace

double RigidMotion::mass() const {
  const double largest = inverse_mass.maxCoeff();
  return largest > 0 ? 1 / largest : 0;
}

Matrix3d RigidMotion::inertia() const {
  Matrix3d inverse = inverse_inertia;
  Vector3d rotates = Vector3d::Ones();
  for (int k = 0; k < 3; ++k) {
    if (inverse_inertia(k, k) > 0) continue;
    inverse(k, k) = 1;
    rotates[k] = 0;
  }
  const Matrix3d inertia = diagonal_matrix(rotates) * inverse.inverse() * diagonal_matrix(rotates);
  return inertia.allFinite() ? inertia : Matrix3d::Zero();
}

Motion::Motion() = default;
Motion::Motion(const Motion&) = default;
Motion::Motion(Motion&&) noexcept = default;
Motion& Motion::operator=(const Motion&) = default;
Motion& Motion::operator=(Motion&&) noexcept = default;
Motion::~Motion() = default;

void Motion::begin_response() {
  LAZYCCD_ASSERT(start().size() == end.size() && soft_count() <= static_cast<std::int32_t>(size()),
                 "each vertex has a start and an end");
  predicted.resize(size());
  for (std::size_t i = 0; i < size(); ++i) predicted[i] = end_of(static_cast<std::int32_t>(i));
  restart_response();
}

void Motion::restart_response() {
  turn_displacement.clear();
  solved.assign(predicted.begin(), predicted.begin() + soft_count());
  split_displacement.assign(solved.size(), Vector3d::Zero());
  link_displacement.assign(solved.size(), Vector3d::Zero());
  links_moved.clear();
  for (std::int32_t v = 0; v < soft_count(); ++v) round_end(v);
  for (const RigidMotion& body : rigid()) restart_response(body);
  for (ArticulatedMotion& body : articulated) body.restart_response();
}

void Motion::restart_response(const RigidMotion& body) {
  RigidSolution& solution = solution_of(body);
  solution.translation = solution.rotation = solution.split_translation = solution.split_rotation =
      Vector3d::Zero();
  set_end_pose(body, body.predicted);
}

void Motion::restart_response(std::int32_t body) {
  if (rigid_of_body()[body] < 0) {
    for (std::int32_t v = first_vertex()[body]; v < first_vertex()[body + 1]; ++v) {
      solved[v] = predicted[v];
      split_displacement[v].setZero();
      link_displacement[v].setZero();
      round_end(v);
    }
    return;
  }
  const RigidMotion& moved = rigid_of(body);
  restart_response(moved);
  if (moved.articulated >= 0) articulated[moved.articulated].restart_response();
}

void Motion::find_turn_displacement() {
  const auto turns = [](const RigidMotion& body) {
    return body.is_movable() && body.rotation + body.split_rotation != Vector3d::Zero();
  };
  if (turn_displacement.empty()) {
    if (std::none_of(rigid().begin(), rigid().end(), turns)) return;
    turn_displacement.assign(size(), Vector3d::Zero());
  }
  const auto find = [&](std::int32_t v, const RigidMotion& body) {
    turn_displacement[v].setZero();
    if (!turns(body)) return;
    const Vector3d linear =
        body.translation + body.split_translation +
        (body.rotation + body.split_rotation).cross(start_of(v) - body.centre());
    turn_displacement[v] = end_of(v) - predicted[v] - linear;
  };
  for (const RigidMotion& body : rigid()) {
    if (body.is_ball || !body.is_movable()) continue;  // turning does not move a ball's surface
    for (std::int32_t i = 0; i < body.vertex_count; ++i) find(body.first_vertex + i, body);
  }
  for (const auto& [vertex, fixed] : anchored()) find(vertex, rigid()[fixed.rigid]);
}

void Motion::apply_response(const RigidMotion& body) {
  const Vector3d rotation = body.rotation + body.split_rotation;
  const double angle = rotation.norm();
  btTransform pose = body.predicted;
  if (angle > 0) {
    const btQuaternion turn(to_bullet(rotation / angle), static_cast<btScalar>(angle));
    pose.setBasis(btMatrix3x3(turn) * body.predicted.getBasis());
  }
  pose.getOrigin() += to_bullet(body.translation + body.split_translation);
  set_end_pose(body, pose);
}

void Motion::apply_response(ArticulatedMotion& body) {
  body.set_end_pose();
  read_link_poses(body);
}

void Motion::hold_at_start(ArticulatedMotion& body) {
  body.held = true;
  body.set_end_pose();
  for (const ArticulatedMotion::Link& link : body.links) set_end_to_start(rigid()[link.rigid]);
}

void Motion::read_link_poses(const ArticulatedMotion& body) {
  for (const ArticulatedMotion::Link& link : body.links)
    set_end_pose(rigid()[link.rigid], rigid()[link.rigid].object->getWorldTransform());
}

void Motion::set_end_pose(const RigidMotion& body, const btTransform& pose) {
  solution_of(body).end = pose;
  write_vertices(body, body.local, pose, end);
  for (const std::int32_t vertex : body.anchored)
    set_anchored_end(vertex, pose * anchored().find(vertex)->local);
}

void Motion::set_end_to_start(const RigidMotion& body) {
  set_end_pose(body, body.start);
  if (body.local_at_start) write_vertices(body, body.local_at_start, body.start, end);
  for (const std::int32_t vertex : body.anchored)
    set_anchored_end(vertex, &start()[3 * static_cast<std::size_t>(vertex)]);
}

bool Motion::is_held(const RigidMotion& body) const {
  const auto first = 3 * static_cast<std::ptrdiff_t>(body.first_vertex);
  return body.local_at_start &&
         std::equal(start().begin() + first, start().begin() + first + 3 * body.vertex_count,
                    end.begin() + first);
}

void Motion::set_end_to_start(std::int32_t soft_vertex) {
  split_displacement[soft_vertex] = start_of(soft_vertex) - solved[soft_vertex];
  const auto first = 3 * static_cast<std::ptrdiff_t>(soft_vertex);
  std::copy_n(start().begin() + first, 3, end.begin() + first);
}

void Motion::set_anchored_end(std::int32_t vertex, const btScalar* x) {
  std::copy_n(x, 3, &end[3 * static_cast<std::size_t>(vertex)]);
  solved[vertex] = end_of(vertex);
}

void StepInput::anchor(std::int32_t soft_vertex, const AnchoredVertex& fixed) {
  LAZYCCD_ASSERT(soft_vertex >= 0 && soft_vertex < static_cast<std::int32_t>(inverse_mass.size()),
                 "a node that is anchored is soft");
  LAZYCCD_ASSERT(fixed.rigid >= 0 && fixed.rigid < static_cast<int>(rigid.size()),
                 "a node is anchored to a rigid body of the motion");
  release(soft_vertex);
  anchored.add(soft_vertex, fixed);
  rigid[fixed.rigid].anchored.push_back(soft_vertex);
}

void StepInput::release(std::int32_t soft_vertex) {
  const AnchoredVertex* const found = anchored.find(soft_vertex);
  if (!found) return;
  ScratchVector<std::int32_t>& of_body = rigid[found->rigid].anchored;
  of_body.erase(std::find(of_body.begin(), of_body.end(), soft_vertex));
  anchored.remove(soft_vertex);
}

int Motion::anchor_body_of(std::int32_t soft_vertex) const {
  const AnchoredVertex* const found = anchored().find(soft_vertex);
  return found ? found->rigid : -1;
}

bool Motion::deviates_less_than(Span<const Body> bodies, double between_bodies,
                                Span<const double> within_body) const {
  constexpr double margin = 0.998;  // covers rounding
  double largest_before = 0;        // over the bodies before this one
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    double squared = 0;
    for (std::int32_t v = first_vertex()[body]; v < first_vertex()[body + 1]; ++v)
      squared = std::max(squared, (end_of(v) - predicted[v]).squaredNorm());
    const double deviation = std::sqrt(squared);
    if (body > 0 && deviation + largest_before > margin * between_bodies) return false;
    if (bodies[body].self_collision && 2 * deviation > margin * within_body[body]) return false;
    largest_before = std::max(largest_before, deviation);
  }
  return true;
}

bool Motion::has_prescribed_motion(std::int32_t body) const {
  if (rigid_of_body()[body] >= 0) {
    const RigidMotion& moved = rigid_of(body);
    return !moved.is_movable() && !moved.stands_still();
  }
  for (std::int32_t v = first_vertex()[body]; v < first_vertex()[body + 1]; ++v)
    if (!is_movable(v) && start_of(v) != end_of(v)) return true;
  return false;
}

void StepInput::write_start_vertices(const RigidMotion& body) {
  write_vertices(body, body.local_at_start ? body.local_at_start : body.local, body.start, start);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
