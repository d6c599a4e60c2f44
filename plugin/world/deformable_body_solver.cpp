#include "lazyccd/bullet/deformable_body_solver.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletSoftBody/btSoftBody.h>

#include "world/soft_body_dbvt.h"
#include "step/pipeline.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// As btDeformableFaceNodeContact has it in btSoftBodyInternals.h, CollideVF_DD.
double friction(double kdf_a, double kdf_b) { return kdf_a * kdf_b; }

// Where btDeformableBodySolver::applyTransforms would put a node, its limit on the velocity
// included.
btVector3 predicted_end(const btSoftBody::Node& node, btScalar time_step, btScalar limit) {
  btVector3 v = node.m_v;
  for (int k = 0; k < 3; ++k) v[k] = btMax(-limit, btMin(limit, v[k]));
  return node.m_x + time_step * (v + node.m_splitv);
}

void put(const btVector3& x, std::int32_t vertex, std::vector<btScalar>& positions) {
  for (int k = 0; k < 3; ++k) positions[3 * static_cast<std::size_t>(vertex) + k] = x[k];
}

void fill(const SoftScene& scene, const SoftScene::BodyRecord& record, std::int32_t first,
          std::int32_t last, Motion& motion, btScalar time_step) {
  const btSoftBody& body = *record.body;
  const btScalar limit = body.m_worldInfo->m_maxDisplacement / time_step;
  for (std::int32_t v = first; v < last; ++v) {
    const btSoftBody::Node& node = body.m_nodes[scene.node_index(v)];
    put(node.m_x, v, motion.start);
    put(predicted_end(node, time_step, limit), v, motion.end);
    motion.velocity[v] = to_eigen(node.m_v);
  }
  // The base class puts anchored nodes where their rigid body has them, whatever their velocity.
  for (int i = 0; i < body.m_deformableAnchors.size(); ++i) {
    const btSoftBody::DeformableNodeRigidAnchor& anchor = body.m_deformableAnchors[i];
    const int node = static_cast<int>(anchor.m_node - &body.m_nodes[0]);
    if (node < scene.node_index(first) || node > scene.node_index(last - 1)) continue;
    const std::int32_t v = scene.vertex_of(record, node);
    if (v < 0) continue;
    put(anchor.m_cti.m_colObj->getWorldTransform() * anchor.m_local, v, motion.end);
    motion.inverse_mass[v] = 0;
  }
}

}  // namespace

btLazyDeformableBodySolver::btLazyDeformableBodySolver(const SolverOptions& options)
    : pipeline_(std::make_unique<Pipeline>(options, friction)),
      trees_(std::make_unique<SoftBodyDbvt>()) {}

btLazyDeformableBodySolver::~btLazyDeformableBodySolver() = default;

Span<const StepContact> btLazyDeformableBodySolver::contacts() const {
  return pipeline_->contacts();
}
const StepStats& btLazyDeformableBodySolver::step_stats() const { return pipeline_->step(); }
const StepStats& btLazyDeformableBodySolver::total_stats() const { return pipeline_->total(); }
std::string btLazyDeformableBodySolver::status() const { return pipeline_->status(); }
void btLazyDeformableBodySolver::topology_changed() { pipeline_->invalidate(); }
bool btLazyDeformableBodySolver::is_active() const { return pipeline_->is_active(); }

void btLazyDeformableBodySolver::handle_pair(btSoftBody* a, btSoftBody* b) {
  if (pipeline_->handle_pair(a, b)) return;
  for (btSoftBody* body : {a, b}) trees_->bring_up_to_date(*body, nullptr);
  btDeformableBodySolver::processCollision(a, b);
}

void btLazyDeformableBodySolver::processCollision(btSoftBody* body,
                                                  const btCollisionObjectWrapper* other) {
  if (pipeline_->handles(body, other->getCollisionObject())) return;
  trees_->bring_up_to_date(*body, other->getCollisionObject());
  btDeformableBodySolver::processCollision(body, other);
}

void btLazyDeformableBodySolver::processCollision(btSoftBody* a, btSoftBody* b) {
  handle_pair(a, b);
}

void btLazyDeformableBodySolver::predictMotion(btScalar solverdt) {
  pipeline_->begin_step(m_softBodies);
  // Where Bullet leaves those of bodies that sleep, it might act on an old step's.
  for (int i = 0; i < m_softBodies.size(); ++i) m_softBodies[i]->m_nodeRigidContacts.clear();
  trees_->begin_prediction(m_softBodies, btSoftBody::fCollision::SDF_RD, !pipeline_->is_active());
  if (pipeline_->is_active()) trees_->hide_nodes(m_softBodies);
  btDeformableBodySolver::predictMotion(solverdt);
  trees_->end_prediction();
}

void btLazyDeformableBodySolver::solveDeformableConstraints(btScalar solverdt) {
  btDeformableBodySolver::solveDeformableConstraints(solverdt);
  silence_bullet();
}

void btLazyDeformableBodySolver::silence_bullet() {
  // What follows in the stock world is its discrete soft-against-soft handling, which heeds no
  // filter and loses momentum. It looks for VF_DD, so the flag is away until applyTransforms().
  silenced_.clear();
  if (!pipeline_->is_active()) return;
  for (int i = 0; i < m_softBodies.size(); ++i) {
    btSoftBody* body = m_softBodies[i];
    if (!(body->m_cfg.collisions & btSoftBody::fCollision::VF_DD)) continue;
    body->m_cfg.collisions &= ~btSoftBody::fCollision::VF_DD;
    silenced_.push_back(body);
  }
}

void btLazyDeformableBodySolver::restore_bullet() {
  for (btSoftBody* body : silenced_) body->m_cfg.collisions |= btSoftBody::fCollision::VF_DD;
  silenced_.clear();
}

void btLazyDeformableBodySolver::applyTransforms(btScalar timeStep) {
  restore_bullet();
  const auto read = [timeStep](const SoftScene& scene, const SoftScene::BodyRecord& record,
                               std::int32_t first, std::int32_t last, Motion& motion) {
    fill(scene, record, first, last, motion, timeStep);
  };
  const bool ours = pipeline_->run(m_softBodies, static_cast<double>(timeStep), read);
  if (ours) write_velocities();
  btDeformableBodySolver::applyTransforms(timeStep);
  if (!ours) return;
  write_positions();
  pipeline_->write_rigid_bodies();
  pipeline_->detect_ahead();
  list_contacts();
  pipeline_->announce();
}

void btLazyDeformableBodySolver::write_velocities() {
  if (!pipeline_->responded()) return;
  const SoftScene& scene = pipeline_->scene();
  const Motion& motion = pipeline_->motion();
  pipeline_->write([&](const SoftScene::BodyRecord& record, std::int32_t first, std::int32_t last) {
    for (std::int32_t v = first; v < last; ++v) {
      if (pipeline_->is_moved(v))
        record.body->m_nodes[scene.node_index(v)].m_v += to_bullet(motion.velocity_change[v]);
    }
  });
  pipeline_->wake_moved();
}

void btLazyDeformableBodySolver::write_positions() {
  // The base class computes the positions anew from the velocities, with its own rounding. What was
  // found clean is to be what the next step starts from, bit for bit.
  const SoftScene& scene = pipeline_->scene();
  const Motion& motion = pipeline_->motion();
  pipeline_->write([&](const SoftScene::BodyRecord& record, std::int32_t first, std::int32_t last) {
    for (std::int32_t v = first; v < last; ++v) {
      scene.fetch_ahead(record, v);
      const btScalar* end = &motion.end[3 * static_cast<std::size_t>(v)];
      btSoftBody::Node& node = record.body->m_nodes[scene.node_index(v)];
      node.m_x = node.m_q = btVector3(end[0], end[1], end[2]);
    }
  });
}

void btLazyDeformableBodySolver::list_contacts() {
  // As Bullet's CollideVF_DD fills them (btSoftBodyInternals.h). applyRepulsionForce has run for
  // this step, and the lists are cleared before it runs again, so they are for applications to
  // read.
  for (int i = 0; i < m_softBodies.size(); ++i) {
    m_softBodies[i]->m_faceNodeContacts.resize(0);
    m_softBodies[i]->m_faceNodeContactsCCD.resize(0);
  }
  for (const StepContact& contact : pipeline_->contacts()) {
    btSoftBody* const node_body = btSoftBody::upcast(contact.body_a);
    if (!node_body || contact.kind != ContactKind::vertex_face) continue;
    if (!contact.face) {
      btSoftBody::DeformableNodeRigidContact rigid;
      rigid.m_cti.m_colObj = contact.body_b;
      rigid.m_cti.m_normal = contact.normal;
      rigid.m_cti.m_offset = -contact.normal.dot(contact.point);
      rigid.m_node = contact.nodes[0];
      rigid.m_c1 = contact.point - contact.body_b->getWorldTransform().getOrigin();
      rigid.m_c0.setIdentity();
      rigid.m_c5.setIdentity();
      rigid.m_c2 = rigid.m_c4 = 0;
      btPlaneSpace1(contact.normal, rigid.t1, rigid.t2);
      rigid.m_c3 = node_body->m_cfg.kDF * contact.body_b->getFriction();
      node_body->m_nodeRigidContacts.push_back(rigid);
      continue;
    }
    const btSoftBody& a = *node_body;
    const btSoftBody& b = *btSoftBody::upcast(contact.body_b);
    btSoftBody::DeformableFaceNodeContact c;
    c.m_node = contact.nodes[0];
    c.m_face = contact.face;
    c.m_bary = btVector3(static_cast<btScalar>(-contact.weights[1]),
                         static_cast<btScalar>(-contact.weights[2]),
                         static_cast<btScalar>(-contact.weights[3]));
    c.m_weights = btVector3(0, 0, 0);
    c.m_normal = contact.normal;
    c.m_margin = a.getCollisionShape()->getMargin() + b.getCollisionShape()->getMargin();
    c.m_friction = a.m_cfg.kDF * b.m_cfg.kDF;
    c.m_imf = 0;
    c.m_c0 = 0;
    c.m_colObj = contact.body_b;
    node_body->m_faceNodeContacts.push_back(c);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
