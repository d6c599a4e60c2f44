#include "scene/rigid_motions.h"

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "motion/articulated_motion.h"
#include "motion/rotation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Returns velocities, inverse mass and inverse inertia of a body; the caller fills the rest.
// Static, kinematic and other bodies that contacts cannot move have inverse mass and inertia zero.
RigidMotion rigid_motion(const btCollisionObject& object) {
  RigidMotion motion;
  motion.velocity = motion.angular_velocity = motion.inverse_mass = Vector3d::Zero();
  motion.inverse_inertia = Matrix3d::Zero();
  const btRigidBody* body = btRigidBody::upcast(&object);
  if (!body || body->getActivationState() == DISABLE_SIMULATION) return motion;
  motion.velocity = to_double(body->getLinearVelocity());
  motion.angular_velocity = to_double(body->getAngularVelocity());
  if (body->isStaticOrKinematicObject()) return motion;
  motion.inverse_mass =
      static_cast<double>(body->getInvMass()) * to_double(body->getLinearFactor());
  const Matrix3d free = diagonal_matrix(to_double(body->getAngularFactor()));
  motion.inverse_inertia = free * to_double(body->getInvInertiaTensorWorld()) * free;
  return motion;
}

bool is_ball_about_origin(const Triangles& triangles) {
  if (triangles.round_parts.size() != 1 || !triangles.is_round()) return false;
  const std::array<btVector3, 2>& core = triangles.round_parts[0].core;
  return core[0].isZero() && core[1].isZero();
}

// Fills Motion::articulated with the multibodies that joints or a free base move.
void find_multibodies(const Obstacles& obstacles, Motion& motion) {
  motion.articulated.clear();
  for (std::size_t i = 0; i < motion.rigid().size(); ++i) {
    RigidMotion& rigid = motion.input().rigid[i];
    const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(rigid.object);
    if (!link || !is_movable(*link)) continue;
    btMultiBody* const body = link->m_multiBody;
    auto found = std::find_if(motion.articulated.begin(), motion.articulated.end(),
                              [body](const ArticulatedMotion& a) { return a.body == body; });
    if (found == motion.articulated.end()) {
      const MultibodyPose* const start = obstacles.start_of(*body);
      motion.articulated.emplace_back(*body, start ? *start : pose_of(*body));
      found = motion.articulated.end() - 1;
    }
    rigid.articulated = static_cast<int>(found - motion.articulated.begin());
    found->add_link(link->m_link, static_cast<int>(i), rigid.start.getOrigin());
  }
}

// Index in Motion::rigid of the bodies that impulses move.
std::map<const btCollisionObject*, int> find_movable(const Motion& motion) {
  std::map<const btCollisionObject*, int> found;
  for (std::size_t i = 0; i < motion.rigid().size(); ++i)
    if (motion.rigid()[i].is_movable())
      found.insert({motion.rigid()[i].object, static_cast<int>(i)});
  return found;
}

}  // namespace

void read_rigid_motions(const StepTopology& topology, const Obstacles& obstacles, Motion& motion) {
  StepInput& input = motion.input();
  input.first_vertex.clear();
  input.rigid_of_body.clear();
  input.rigid.clear();
  input.anchored.clear();
  input.start.resize(3 * static_cast<std::size_t>(topology.vertex_count()));
  motion.end.resize(input.start.size());
  for (const StepTopology::BodyRecord& body : topology.bodies()) {
    input.first_vertex.push_back(body.first_vertex);
    input.rigid_of_body.push_back(body.soft ? -1 : static_cast<std::int32_t>(input.rigid.size()));
    if (body.soft) continue;
    const Obstacles::Record& record = obstacles.records()[body.obstacle];
    RigidMotion rigid = rigid_motion(*body.object);
    rigid.object = body.object;
    rigid.first_vertex = body.first_vertex;
    rigid.vertex_count = body.vertex_count;
    rigid.is_ball = body.triangles && is_ball_about_origin(*body.triangles);
    rigid.local = obstacles.local_positions().data() + record.first_vertex;
    if (record.last_vertices) rigid.local_at_start = record.last_vertices->data();
    rigid.is_driven = record.driven;
    rigid.start = record.start;
    rigid.predicted = rigid.end = record.end;
    rigid.is_conveyor = body.object->isStaticObject() && rigid.stands_still() &&
                        !(rigid.velocity.isZero() && rigid.angular_velocity.isZero());
    input.rigid.push_back(rigid);
    input.write_start_vertices(rigid);
    motion.set_end_pose(input.rigid.back(), record.end);
  }
  input.first_vertex.push_back(topology.vertex_count());
  find_multibodies(obstacles, motion);
}

void find_anchored_vertices(const SoftScene& scene, Motion& motion) {
  std::optional<std::map<const btCollisionObject*, int>> movable;  // made for the first anchor
  for (const SoftScene::BodyRecord& record : scene.bodies()) {
    const auto& anchors = record.body->m_deformableAnchors;
    for (int i = 0; i < anchors.size(); ++i) {
      const int node = static_cast<int>(anchors[i].m_node - &record.body->m_nodes[0]);
      const std::int32_t v = scene.vertex_of(record, node);
      // Skips pinned nodes, through which Bullet's anchors push nothing, and nodes that the anchor
      // does not move, as in the rigid world.
      if (v < 0 || anchors[i].m_node->m_im == 0 || motion.inverse_mass()[v] > 0) continue;
      motion.input().release(v);  // the last of several anchors counts
      if (!movable) movable = find_movable(motion);
      const auto rigid = movable->find(anchors[i].m_cti.m_colObj);
      if (rigid != movable->end()) motion.input().anchor(v, {anchors[i].m_local, rigid->second});
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
