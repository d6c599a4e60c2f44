#include "lazyccd/bullet/soft_body_solver.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>

#include "world/soft_body_dbvt.h"
#include "step/pipeline.h"
#include "links/soft_constraints.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// As btSoftBody's ColliderStatic and CollideVF_SS combine them.
double friction(double kdf_a, double kdf_b) { return std::max(kdf_a, kdf_b); }

}  // namespace

btLazySoftBodySolver::btLazySoftBodySolver(const SolverOptions& options)
    : pipeline_(std::make_unique<Pipeline>(options, friction)),
      trees_(std::make_unique<SoftBodyDbvt>()),
      constraints_(std::make_unique<SoftConstraints>()) {}

btLazySoftBodySolver::~btLazySoftBodySolver() = default;

Span<const StepContact> btLazySoftBodySolver::contacts() const { return pipeline_->contacts(); }
const StepStats& btLazySoftBodySolver::step_stats() const { return pipeline_->step(); }
const StepStats& btLazySoftBodySolver::total_stats() const { return pipeline_->total(); }
std::string btLazySoftBodySolver::status() const { return pipeline_->status(); }
void btLazySoftBodySolver::topology_changed() { pipeline_->invalidate(); }

void btLazySoftBodySolver::handle_pair(btSoftBody* a, btSoftBody* b) {
  if (!pipeline_->handle_pair(a, b)) btDefaultSoftBodySolver::processCollision(a, b);
}

void btLazySoftBodySolver::predictMotion(btScalar solverdt) {
  pipeline_->begin_step(m_softBodySet);
  trees_->begin_prediction(m_softBodySet, btSoftBody::fCollision::VF_SS, !pipeline_->is_active());
  btDefaultSoftBodySolver::predictMotion(solverdt);
  trees_->end_prediction();
  // Bullet predicts and clears the lists of active bodies only. One that sleeps here and is woken
  // by this step's collisions would act on the contacts and begin at the places of an old step.
  for (int i = 0; i < m_softBodySet.size(); ++i) {
    btSoftBody& body = *m_softBodySet[i];
    body.m_scontacts.resize(0);
    body.m_rcontacts.clear();
    for (int j = 0; !body.isActive() && j < body.m_nodes.size(); ++j)
      body.m_nodes[j].m_q = body.m_nodes[j].m_x;
  }
}

void btLazySoftBodySolver::processCollision(btSoftBody* body,
                                            const btCollisionObjectWrapper* other) {
  if (pipeline_->handles(body, other->getCollisionObject())) return;
  trees_->bring_up_to_date(*body, other->getCollisionObject());
  btDefaultSoftBodySolver::processCollision(body, other);
}

void btLazySoftBodySolver::processCollision(btSoftBody* a, btSoftBody* b) { handle_pair(a, b); }

void btLazySoftBodySolver::solveConstraints(btScalar solverdt) {
  // Drift iterations overwrite the start of the step in m_q, so it is copied first.
  read_starts();
  constraints_->solve(m_softBodySet, [this](std::size_t count, std::size_t grain, const auto& body) {
    pipeline_->threads().parallel_for(count, grain, body);
  });
  const auto fill = [this, solverdt](const SoftScene& scene, const SoftScene::BodyRecord& record,
                                     std::int32_t first, std::int32_t last, Motion& motion) {
    const std::vector<btVector3>& starts = starts_[record.world_index];
    // As btSoftBody::solveConstraints() has it, with the body's own time step and damping. Without
    // the damping, what carries a load would leave with its part of it.
    const btSoftBody::Config& config = record.body->m_cfg;
    const btScalar isdt = 1 / (solverdt * config.timescale);
    const double rate = static_cast<double>(isdt * (1 - config.kDP));
    for (std::int32_t v = first; v < last; ++v) {
      const int index = scene.node_index(v);
      const btSoftBody::Node& node = record.body->m_nodes[index];
      for (int k = 0; k < 3; ++k) {
        motion.start[3 * static_cast<std::size_t>(v) + k] = starts[index][k];
        motion.end[3 * static_cast<std::size_t>(v) + k] = node.m_x[k];
      }
      motion.velocity[v] = to_eigen(node.m_v);
      motion.rate[v] = rate;
    }
  };
  if (!pipeline_->run(m_softBodySet, static_cast<double>(solverdt), fill)) return;
  if (pipeline_->responded()) write_back();
  pipeline_->detect_ahead();
  list_contacts();
}

// The last call of a step: bodies may be removed in what hears of its contacts.
void btLazySoftBodySolver::updateSoftBodies() {
  btDefaultSoftBodySolver::updateSoftBodies();
  pipeline_->announce();
}

void btLazySoftBodySolver::read_starts() {
  starts_.resize(m_softBodySet.size());
  for (int i = 0; i < m_softBodySet.size(); ++i) {
    const btSoftBody& body = *m_softBodySet[i];
    starts_[i].resize(body.m_nodes.size());
    for (int j = 0; j < body.m_nodes.size(); ++j) starts_[i][j] = body.m_nodes[j].m_q;
  }
}

void btLazySoftBodySolver::write_back() {
  pipeline_->write_rigid_bodies();
  const SoftScene& scene = pipeline_->scene();
  const Motion& motion = pipeline_->motion();
  pipeline_->write([&](const SoftScene::BodyRecord& record, std::int32_t first, std::int32_t last) {
    for (std::int32_t v = first; v < last; ++v) {
      if (!pipeline_->is_moved(v)) continue;
      btSoftBody::Node& node = record.body->m_nodes[scene.node_index(v)];
      const btScalar* end = &motion.end[3 * static_cast<std::size_t>(v)];
      node.m_x = btVector3(end[0], end[1], end[2]);
      node.m_v += to_bullet(motion.velocity_change[v]);
    }
  });
  pipeline_->wake_moved();
}

void btLazySoftBodySolver::list_contacts() {
  // As Bullet's CollideVF_SS fills them (btSoftBodyInternals.h). Bullet's solver has done its work
  // for this step and clears the list before the next one, so they are for applications to read.
  for (const StepContact& contact : pipeline_->contacts()) {
    btSoftBody* const node_body = btSoftBody::upcast(contact.body_a);
    if (!node_body || contact.kind != ContactKind::vertex_face) continue;
    if (!contact.face) {
      btSoftBody::RContact rigid;
      rigid.m_cti.m_colObj = contact.body_b;
      rigid.m_cti.m_normal = contact.normal;
      rigid.m_cti.m_offset = -contact.normal.dot(contact.point);
      rigid.m_node = contact.nodes[0];
      rigid.m_c1 = contact.point - contact.body_b->getWorldTransform().getOrigin();
      rigid.m_c3 = node_body->m_cfg.kDF * contact.body_b->getFriction();
      rigid.m_c0.setIdentity();
      rigid.m_c2 = rigid.m_c4 = 0;
      btPlaneSpace1(contact.normal, rigid.t1, rigid.t2);
      node_body->m_rcontacts.push_back(rigid);
      continue;
    }
    const btSoftBody& a = *node_body;
    const btSoftBody& b = *btSoftBody::upcast(contact.body_b);
    btSoftBody::SContact c;
    c.m_node = contact.nodes[0];
    c.m_face = contact.face;
    c.m_weights = btVector3(static_cast<btScalar>(-contact.weights[1]),
                            static_cast<btScalar>(-contact.weights[2]),
                            static_cast<btScalar>(-contact.weights[3]));
    c.m_normal = contact.normal;
    c.m_margin = a.getCollisionShape()->getMargin() + b.getCollisionShape()->getMargin();
    c.m_friction = btMax(a.m_cfg.kDF, b.m_cfg.kDF);
    const btScalar node_share = contact.nodes[0]->m_im;
    btScalar face_share = 0;
    for (int k = 0; k < 3; ++k) face_share += c.m_weights[k] * contact.nodes[k + 1]->m_im;
    const btScalar shares = node_share + face_share;
    c.m_cfm[0] = shares > 0 ? node_share / shares * a.m_cfg.kSHR : 0;
    c.m_cfm[1] = shares > 0 ? face_share / shares * b.m_cfg.kSHR : 0;
    node_body->m_scontacts.push_back(c);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
