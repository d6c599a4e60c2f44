#include "bodies/predict_motion.h"

#include <BulletCollision/BroadphaseCollision/btBroadphaseInterface.h>

#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Scope in which bodies have no handle of the broad phase, so that Bullet tells it nothing.
class WithoutBroadphase {
 public:
  explicit WithoutBroadphase(const SideBySide::Bodies& bodies) : bodies_(bodies) {
    for (int i = 0; i < bodies.size(); ++i) {
      handles_.push_back(bodies[i]->getBroadphaseHandle());
      bodies[i]->setBroadphaseHandle(nullptr);
    }
  }
  ~WithoutBroadphase() {
    for (int i = 0; i < bodies_.size(); ++i)
      bodies_[i]->setBroadphaseHandle(handles_[static_cast<std::size_t>(i)]);
  }
  WithoutBroadphase(const WithoutBroadphase&) = delete;
  WithoutBroadphase& operator=(const WithoutBroadphase&) = delete;

 private:
  const SideBySide::Bodies& bodies_;
  ScratchVector<btBroadphaseProxy*> handles_;
};

// True if no force but gravity acts on the body, except for the forces in its nodes.
bool has_no_forces(const btSoftBody::Config& config) {
  return !(config.kLF > 0) && !(config.kDG > 0) && config.kPR == 0 && !(config.kVC > 0);
}

// Moves a node by its velocity and the forces on it.
void integrate(btSoftBody::Node& node, btScalar dt, btScalar max_change) {
  node.m_q = node.m_x;
  btVector3 change = node.m_f * node.m_im * dt;
  for (int k = 0; k < 3; ++k) {
    if (change[k] > max_change) change[k] = max_change;
    if (change[k] < -max_change) change[k] = -max_change;
  }
  node.m_v += change;
  node.m_x += node.m_v * dt;
  node.m_f.setZero();
}

void integrate(btSoftBody& body, const btVector3& gravity) {
  const btScalar dt = body.m_sst.sdt, max_change = body.m_worldInfo->m_maxDisplacement / dt;
  const btVector3 change = gravity * dt;
  const bool only_gravity = has_no_forces(body.m_cfg);
  if (!only_gravity) {
    body.addVelocity(change);
    body.applyForces();
  }
  btVector3 low = body.m_nodes[0].m_x, high = low;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    btSoftBody::Node& node = body.m_nodes[i];
    if (only_gravity && node.m_im > 0) node.m_v += change;
    integrate(node, dt, max_change);
    if (i == 0) low = high = node.m_x;
    for (int k = 0; k < 3; ++k) {
      if (node.m_x[k] > high[k]) high[k] = node.m_x[k];
      if (node.m_x[k] < low[k]) low[k] = node.m_x[k];
    }
  }
  const btScalar margin = body.getCollisionShape()->getMargin();
  const btVector3 margins(margin, margin, margin);
  body.m_bounds[0] = low - margins;
  body.m_bounds[1] = high + margins;
}

// Draws the nodes to the shape that the body had when its pose was set.
void match_pose(btSoftBody& body) {
  if (!body.m_pose.m_bframe || !(body.m_cfg.kMT > 0)) return;
  const btMatrix3x3 rotation = body.m_pose.m_rot;
  for (int i = 0; i < body.m_nodes.size(); ++i) {
    btSoftBody::Node& node = body.m_nodes[i];
    if (!(node.m_im > 0)) continue;
    const btVector3 goal = rotation * body.m_pose.m_pos[i] + body.m_pose.m_com;
    node.m_x = node.m_x + (goal - node.m_x) * body.m_cfg.kMT;
  }
}

// Keeps the memory.
template <class List>
void empty(List& list) {
  while (list.size() > 0) list.pop_back();
}

}  // namespace

bool predicts_alone(const btSoftBody& body) {
  const bool reads_faces =
      !has_no_forces(body.m_cfg) || !body.m_fdbvt.empty() || body.m_bUpdateRtCst;
  return !reads_faces || has_own_faces(body);
}

void predict_without_trees(btSoftBody& body, btScalar dt) {
  body.m_sst.sdt = dt * body.m_cfg.timescale;
  body.m_sst.isdt = 1 / body.m_sst.sdt;
  body.m_sst.velmrg = body.m_sst.sdt * 3;
  body.m_sst.radmrg = body.getCollisionShape()->getMargin();
  body.m_sst.updmrg = body.m_sst.radmrg * btScalar(0.25);
  if (body.m_nodes.size() > 0) {
    integrate(body, body.m_worldInfo->m_gravity);
  } else {
    body.m_bounds[0] = body.m_bounds[1] = btVector3(0, 0, 0);
  }
  body.updateClusters();
  body.updatePose();
  match_pose(body);
  empty(body.m_rcontacts);
  empty(body.m_scontacts);
  body.m_cdbvt.optimizeIncremental(1);
}

void predict_motions(const SideBySide::Bodies& bodies, const SideBySide& side_by_side,
                     FunctionRef<void(btSoftBody&)> predict) {
  ScratchVector<char> was_active;
  for (int i = 0; i < bodies.size(); ++i) was_active.push_back(bodies[i]->isActive());
  {
    const WithoutBroadphase scope(bodies);
    ScratchVector<char> is_predicted(was_active.size(), 0);
    for (int i = 0; i < bodies.size(); ++i) {
      if (!was_active[static_cast<std::size_t>(i)] || !bodies[i]->m_bUpdateRtCst) continue;
      predict(*bodies[i]);
      is_predicted[static_cast<std::size_t>(i)] = 1;
    }
    side_by_side.for_each([&](int i) {
      const auto index = static_cast<std::size_t>(i);
      if (was_active[index] && !is_predicted[index]) predict(*bodies[i]);
    });
  }
  for (int i = 0; i < bodies.size(); ++i) {
    const btSoftBody& body = *bodies[i];
    btBroadphaseProxy* const handle = bodies[i]->getBroadphaseHandle();
    if (!was_active[static_cast<std::size_t>(i)] || !handle || body.m_nodes.size() == 0) continue;
    btSoftBodyWorldInfo& info = *body.m_worldInfo;
    info.m_broadphase->setAabb(handle, body.m_bounds[0], body.m_bounds[1], info.m_dispatcher);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
