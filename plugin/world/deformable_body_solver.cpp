#include "lazyccd/bullet/deformable_body_solver.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <typeinfo>
#include <utility>

#include "bodies/deformable_motion.h"
#include "bodies/expected_contacts.h"
#include "bodies/momentum_equation.h"
#include "bodies/normals.h"
#include "bodies/predict_motion.h"
#include "report/bullet_contact_lists.h"
#include "step/pipeline.h"
#include "util/profile.h"
#include "util/scratch_vector.h"
#include "world/soft_body_dbvt.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Requests a face tree, as in btDeformableBodySolver::predictDeformableMotion().
constexpr int face_tree_flag_sdf_rd = btSoftBody::fCollision::SDF_RD;

// Position at which btDeformableBodySolver::applyTransforms would put a node, including its limit
// on the velocity.
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
    put(node.m_x, v, motion.input().start);
    put(predicted_end(node, time_step, limit), v, motion.end);
    motion.input().velocity[v] = to_double(node.m_v);
  }
  // The base class puts anchored nodes at the place that their rigid body gives them, whatever
  // their velocity.
  for (int i = 0; i < body.m_deformableAnchors.size(); ++i) {
    const btSoftBody::DeformableNodeRigidAnchor& anchor = body.m_deformableAnchors[i];
    const int node = static_cast<int>(anchor.m_node - &body.m_nodes[0]);
    if (node < scene.node_index(first) || node > scene.node_index(last - 1)) continue;
    const std::int32_t v = scene.vertex_of(record, node);
    if (v < 0) continue;
    put(anchor.m_cti.m_colObj->getWorldTransform() * anchor.m_local, v, motion.end);
    motion.input().inverse_mass[v] = 0;
  }
}

void restore_flag(btSoftBody& body) { body.m_cfg.collisions |= btSoftBody::fCollision::VF_DD; }

}  // namespace

btLazyDeformableBodySolver::btLazyDeformableBodySolver(const SolverOptions& options,
                                                       bool solves_sleepers)
    : pipeline_(std::make_unique<Pipeline>(options, WorldKind::deformable)),
      dbvt_(std::make_unique<SoftBodyDbvt>()),
      side_by_side_(std::make_unique<SideBySide>(pipeline_->threads())),
      normals_(std::make_unique<Normals>()),
      body_forces_(std::make_unique<BodyForces>()),
      expected_contacts_(std::make_unique<ExpectedContacts>(
          static_cast<btScalar>(check(options).options.jump_speed))),
      momentum_equation_(std::make_unique<MomentumEquation>()),
      solves_sleepers_(solves_sleepers) {}

btLazyDeformableBodySolver::~btLazyDeformableBodySolver() = default;

Span<const StepContact> btLazyDeformableBodySolver::contacts() const {
  return pipeline_->contacts();
}
const StepStats& btLazyDeformableBodySolver::step_stats() const { return pipeline_->step_stats(); }
const StepStats& btLazyDeformableBodySolver::total_stats() const {
  return pipeline_->total_stats();
}
std::vector<ExcludedBody> btLazyDeformableBodySolver::excluded_bodies() const {
  return pipeline_->excluded_bodies();
}
std::string btLazyDeformableBodySolver::status() const { return pipeline_->status(); }
void btLazyDeformableBodySolver::debug_draw(btIDebugDraw& drawer,
                                            const DebugDrawOptions& options) const {
  pipeline_->debug_draw(drawer, options);
}
void btLazyDeformableBodySolver::topology_changed() {
  expected_contacts_->forget();
  pipeline_->invalidate();
}
void btLazyDeformableBodySolver::use_motors_of(btMultiBodyDynamicsWorld* world) {
  pipeline_->use_motors_of(world);
}

void btLazyDeformableBodySolver::teleported(const btCollisionObject& body) {
  expected_contacts_->forget();
  pipeline_->teleported(body);
}
void btLazyDeformableBodySolver::build_trees(btSoftBody& body) {
  SoftBodyDbvt::build_trees(body, face_tree_flag_sdf_rd);
}
bool btLazyDeformableBodySolver::is_active() const { return pipeline_->ran_last_step(); }

void btLazyDeformableBodySolver::handle_pair(btSoftBody* a, btSoftBody* b) {
  if (pipeline_->handle_pair(a, b)) return;
  dbvt_->update_trees(*a, *b);
  btDeformableBodySolver::processCollision(a, b);
}

namespace {

// With the flag SDF_RD Bullet makes contacts with any object, but sets their matrices for rigid
// bodies and links alone (btSoftColliders::CollideSDF_RD). With other objects, such as ghosts, they
// are what the memory held.
bool would_be_undefined(const btSoftBody& body, const btCollisionObject& other) {
  constexpr int known = btCollisionObject::CO_RIGID_BODY | btCollisionObject::CO_FEATHERSTONE_LINK;
  return (other.getInternalType() & known) == 0 &&
         (body.m_cfg.collisions & btSoftBody::fCollision::RVSmask) ==
             btSoftBody::fCollision::SDF_RD;
}

}  // namespace

void btLazyDeformableBodySolver::processCollision(btSoftBody* body,
                                                  const btCollisionObjectWrapper* other) {
  expected_contacts_->meet(*body, *other->getCollisionObject());
  if (pipeline_->handle_pair(body, other->getCollisionObject())) return;
  if (would_be_undefined(*body, *other->getCollisionObject())) return;
  dbvt_->update_trees(*body, *other->getCollisionObject());
  if (!body->isActive())
    clear_deformable_contact_lists(*body);  // Bullet does not clear those of a sleeper
  btDeformableBodySolver::processCollision(body, other);
}

void btLazyDeformableBodySolver::processCollision(btSoftBody* a, btSoftBody* b) {
  handle_pair(a, b);
}

void btLazyDeformableBodySolver::reinitialize(const btAlignedObjectArray<btSoftBody*>& softBodies,
                                              btScalar dt) {
  // Bullet calls this too, with a negative time, when a body is removed. That may be in the middle
  // of a step, and the body may be deleted next. A step that an exception ended leaves flags off.
  for (btSoftBody* const body : silenced_)
    if (dt > 0 || softBodies.findLinearSearch(body) == softBodies.size()) restore_flag(*body);
  const auto is_restored = [&](const btSoftBody* body) {
    return (body->m_cfg.collisions & btSoftBody::fCollision::VF_DD) != 0;
  };
  silenced_.erase(std::remove_if(silenced_.begin(), silenced_.end(), is_restored), silenced_.end());
  all_bodies_.copyFromArray(softBodies);
  // Bullet's solver spends as much time on a sleeping node as on an awake one.
  const std::vector<const btSoftBody*> left_out = pipeline_->left_out();
  auto next = left_out.begin();
  skipped_.clear();
  btAlignedObjectArray<btSoftBody*> solved;
  bool is_new = false;
  for (int i = 0; i < softBodies.size(); ++i) {
    btSoftBody* const body = softBodies[i];
    const bool is_left_out = next != left_out.end() && *next == body;
    next += is_left_out;
    if (is_left_out && !needs(*body)) {
      skipped_.push_back(body);
      continue;
    }
    const int at = solved.size();
    is_new = is_new || at >= m_softBodies.size() || m_softBodies[at] != body;
    solved.push_back(body);
  }
  std::sort(skipped_.begin(), skipped_.end());
  if (is_new || solved.size() != m_softBodies.size()) m_numNodes = -1;  // numbers the nodes anew
  side_by_side_->begin(solved, moves_alone);
  btDeformableBodySolver::reinitialize(solved, dt);
}

bool btLazyDeformableBodySolver::skips(const btSoftBody& body) const {
  return std::binary_search(skipped_.begin(), skipped_.end(), &body);
}

bool btLazyDeformableBodySolver::needs(const btSoftBody& sleeper) const {
  if (solves_sleepers_ || m_useProjection || sleeper.getActivationState() != ISLAND_SLEEPING ||
      sleeper.m_deformableAnchors.size() > 0)
    return true;
  // These forces leave inactive bodies alone.
  const auto skips_sleepers = [](btDeformableLagrangianForce& force) {
    const btDeformableLagrangianForceType type = force.getForceType();
    return type == BT_GRAVITY_FORCE || type == BT_MASSSPRING_FORCE || type == BT_NEOHOOKEAN_FORCE ||
           type == BT_LINEAR_ELASTICITY_FORCE;
  };
  const btAlignedObjectArray<btDeformableLagrangianForce*>& forces = m_objective->m_lf;
  for (int i = 0; i < forces.size(); ++i)
    if (!skips_sleepers(*forces[i])) return true;
  return false;
}

void btLazyDeformableBodySolver::predictMotion(btScalar solverdt) {
  LAZYCCD_BT_PROFILE("predict");
  pipeline_->begin_step(all_bodies_, typeid(*this) != typeid(btLazyDeformableBodySolver),
                        &m_objective->m_lf);
  expected_contacts_->begin_step();
  // The contact lists of sleeping bodies stay as they are, as with Bullet.
  slept_.clear();
  for (int i = 0; i < all_bodies_.size(); ++i)
    if (!all_bodies_[i]->isActive()) slept_.push_back(all_bodies_[i]);
  std::sort(slept_.begin(), slept_.end());
  dbvt_->begin_prediction(all_bodies_, face_tree_flag_sdf_rd, !pipeline_->ran_last_step());
  if (pipeline_->ran_last_step()) dbvt_->hide_nodes(all_bodies_);
  if (m_implicit) {
    btDeformableBodySolver::predictMotion(solverdt);
  } else {
    applyExplicitForce();
    predict_motions(m_softBodies, *side_by_side_, [this, solverdt](btSoftBody& body) {
      clear_deformable_contact_lists(body);
      predictDeformableMotion(&body, solverdt);
    });
  }
  dbvt_->end_prediction();
}

void btLazyDeformableBodySolver::applyExplicitForce() {
  if (m_implicit || typeid(*m_objective) != typeid(btDeformableBackwardEulerObjective) ||
      !body_forces_->read(m_objective->m_lf, m_softBodies)) {
    btDeformableBodySolver::applyExplicitForce();
    return;
  }
  const DeformableBodies all(m_softBodies, *side_by_side_);
  apply_explicit_forces(all, *body_forces_, m_objective->m_dt, m_residual);
}

void btLazyDeformableBodySolver::setupDeformableSolve(bool implicit) {
  if (implicit) return btDeformableBodySolver::setupDeformableSolve(implicit);
  read_velocity_changes(DeformableBodies(m_softBodies, *side_by_side_), m_backupVelocity, m_dv);
}

void btLazyDeformableBodySolver::updateSoftBodies() {
  LAZYCCD_BT_PROFILE("normals");
  normals_->update(m_softBodies, side_by_side_->parallel_for());
}

bool btLazyDeformableBodySolver::slept(const btSoftBody& body) const {
  return std::binary_search(slept_.begin(), slept_.end(), &body);
}

bool btLazyDeformableBodySolver::fell_asleep(const btSoftBody& body) const {
  return body.getActivationState() == ISLAND_SLEEPING && !slept(body);
}

void btLazyDeformableBodySolver::forget_old_contacts() {
  for (int i = 0; i < all_bodies_.size(); ++i)
    if (slept(*all_bodies_[i]) && all_bodies_[i]->isActive())
      clear_deformable_contact_lists(*all_bodies_[i]);
}

void btLazyDeformableBodySolver::setConstraints(const btContactSolverInfo& info) {
  forget_old_contacts();
  btDeformableBodySolver::setConstraints(info);
}

void btLazyDeformableBodySolver::solveDeformableConstraints(btScalar solverdt) {
  forget_old_contacts();  // of bodies that Bullet's islands woke
  // Forces must not act on such a body if the solver skips it: its nodes have no numbers.
  ScratchVector<std::pair<btSoftBody*, int>> woken;
  for (int i = 0; !skipped_.empty() && i < all_bodies_.size(); ++i) {
    btSoftBody* const body = all_bodies_[i];
    if (!body->isActive() || !skips(*body)) continue;
    woken.emplace_back(body, body->getActivationState());
    body->forceActivationState(ISLAND_SLEEPING);
  }
  solve_momentum_equation(solverdt);
  for (const auto& [body, state] : woken) body->forceActivationState(state);
  silence_bullet();
}

void btLazyDeformableBodySolver::solve_momentum_equation(btScalar time_step) {
  LAZYCCD_BT_PROFILE("momentum equation");
  ScratchVector<int> lost;
  for (const ExcludedBody& excluded : pipeline_->excluded_bodies()) {
    const int body = m_softBodies.findLinearSearch(excluded.body);
    if (body < m_softBodies.size()) lost.push_back(body);
  }
  if (m_implicit || m_useProjection ||
      !momentum_equation_->solve(*m_objective, time_step, m_cr.m_maxIterations, m_cr.m_tolerance,
                                 *side_by_side_, lost, *expected_contacts_, m_residual, m_dv)) {
    btDeformableBodySolver::solveDeformableConstraints(time_step);
    return;
  }
  update_velocities(DeformableBodies(m_softBodies, *side_by_side_), m_backupVelocity, m_dv);
}

void btLazyDeformableBodySolver::silence_bullet() {
  // Next, the stock world runs its discrete soft-against-soft handling, which ignores collision
  // filters and loses momentum. It tests for VF_DD, so the flag stays off until applyTransforms().
  silenced_.clear();
  if (!pipeline_->ran_last_step()) return;
  for (int i = 0; i < all_bodies_.size(); ++i) {
    btSoftBody* body = all_bodies_[i];
    if (!(body->m_cfg.collisions & btSoftBody::fCollision::VF_DD)) continue;
    body->m_cfg.collisions &= ~btSoftBody::fCollision::VF_DD;
    silenced_.push_back(body);
  }
}

void btLazyDeformableBodySolver::restore_bullet() {
  for (btSoftBody* body : silenced_) restore_flag(*body);
  silenced_.clear();
}

void btLazyDeformableBodySolver::applyTransforms(btScalar timeStep) {
  restore_bullet();
  const auto read = [this, timeStep](const SoftScene& scene, const SoftScene::BodyRecord& record,
                                     std::int32_t first, std::int32_t last, Motion& motion) {
    fill(scene, record, first, last, motion, timeStep);
    if (!skips(*record.body) && !fell_asleep(*record.body)) return;
    // The base class does not move the first. The second has the speed that its weight gave it
    // before it fell asleep; its contacts would stop it, and that would wake it.
    const auto begin = motion.start().begin();
    std::copy(begin + 3 * static_cast<std::ptrdiff_t>(first),
              begin + 3 * static_cast<std::ptrdiff_t>(last),
              motion.end.begin() + 3 * static_cast<std::ptrdiff_t>(first));
    const auto velocity = motion.input().velocity.begin();
    std::fill(velocity + first, velocity + last, Vector3d::Zero());
  };
  const bool is_handled = pipeline_->run(all_bodies_, static_cast<double>(timeStep), read);
  if (is_handled) write_velocities();
  move_nodes(timeStep);
  expected_contacts_->forget();
  if (!is_handled) return;
  write_positions();
  pipeline_->write_rigid_bodies();
  expected_contacts_->take(pipeline_->contacts(), pipeline_->moved_apart(), timeStep);
  pipeline_->detect_ahead();
  for (const SoftScene::BodyRecord& record : pipeline_->scene().bodies()) {
    if (!record.body->isActive()) continue;
    record.body->m_faceNodeContacts.resize(0);
    record.body->m_faceNodeContactsCCD.resize(0);
  }
  if (pipeline_->options().fill_contact_lists) fill_deformable_contact_lists(pipeline_->contacts());
  pipeline_->end_step();
}

void btLazyDeformableBodySolver::move_nodes(btScalar time_step) {
  for (int i = 0; i < m_softBodies.size(); ++i) {
    if (!is_anchored_to_link(*m_softBodies[i])) continue;
    btDeformableBodySolver::applyTransforms(time_step);
    return;
  }
  apply_transforms(DeformableBodies(m_softBodies, *side_by_side_), time_step);
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
  // Bullet decides by these speeds which bodies may fall asleep, and has them from before contacts.
  find_largest_speeds(DeformableBodies(m_softBodies, *side_by_side_));
  pipeline_->wake_moved();
}

void btLazyDeformableBodySolver::write_positions() {
  // The base class computes the positions again from the velocities, with its own rounding. The
  // next step must start, bit for bit, from the positions for which detection found no contact
  // left.
  const SoftScene& scene = pipeline_->scene();
  const Motion& motion = pipeline_->motion();
  pipeline_->write([&](const SoftScene::BodyRecord& record, std::int32_t first, std::int32_t last) {
    for (std::int32_t v = first; v < last; ++v) {
      scene.prefetch_node(record, v);
      const btScalar* end = &motion.end[3 * static_cast<std::size_t>(v)];
      btSoftBody::Node& node = record.body->m_nodes[scene.node_index(v)];
      node.m_x = node.m_q = btVector3(end[0], end[1], end[2]);
      node.m_vn = node.m_v;  // for bodies that the base class skips
    }
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
