#include "lazyccd/bullet/soft_body_solver.h"

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <cmath>
#include <typeinfo>
#include <utility>
#include <vector>

#include "bodies/normals.h"
#include "bodies/predict_motion.h"
#include "bodies/side_by_side.h"
#include "links/soft_constraints.h"
#include "report/bullet_contact_lists.h"
#include "settings.h"
#include "step/pipeline.h"
#include "step/scene_links.h"
#include "util/profile.h"
#include "util/scratch_vector.h"
#include "util/soft_body_nodes.h"
#include "world/soft_body_dbvt.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Requests a face tree, as in btSoftBody::predictMotion().
constexpr int face_tree_flag_vf_ss = btSoftBody::fCollision::VF_SS;

// For a body that this step's collisions woke. Otherwise it would act on the contacts, and start
// from the positions, of an old step.
void start_where_it_slept(btSoftBody& body) {
  clear_soft_contact_lists(body);
  for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_q = body.m_nodes[i].m_x;
}

// A body with pressure bounces by its links, as with Bullet. Under weights ropes stay as they are:
// hundreds that a body rolls over would cost much. Tetrahedra turn inside out in an impact, which
// no link undoes, unless links carry it upwards.
LinkSolver::Again links_again(const btSoftBody& body) {
  if (body.m_tetras.size() > 0) return LinkSolver::Again::in_contact;
  const bool is_cloth = body.m_faces.size() > 0 && body.m_cfg.kPR == 0 && body.m_cfg.kVC <= 0;
  return is_cloth ? LinkSolver::Again::under_weight : LinkSolver::Again::where_pushed;
}

}  // namespace

btLazySoftBodySolver::btLazySoftBodySolver(const SolverOptions& options)
    : pipeline_(std::make_unique<Pipeline>(options, WorldKind::rigid)),
      dbvt_(std::make_unique<SoftBodyDbvt>()),
      side_by_side_(std::make_unique<SideBySide>(pipeline_->threads())),
      normals_(std::make_unique<Normals>()),
      scene_links_(std::make_unique<SceneLinks>()),
      constraints_(std::make_unique<SoftConstraints>()) {}

btLazySoftBodySolver::~btLazySoftBodySolver() = default;

Span<const StepContact> btLazySoftBodySolver::contacts() const { return pipeline_->contacts(); }
const StepStats& btLazySoftBodySolver::step_stats() const { return pipeline_->step_stats(); }
const StepStats& btLazySoftBodySolver::total_stats() const { return pipeline_->total_stats(); }
std::vector<ExcludedBody> btLazySoftBodySolver::excluded_bodies() const {
  return pipeline_->excluded_bodies();
}
std::string btLazySoftBodySolver::status() const { return pipeline_->status(); }
void btLazySoftBodySolver::debug_draw(btIDebugDraw& drawer, const DebugDrawOptions& options) const {
  pipeline_->debug_draw(drawer, options);
}
void btLazySoftBodySolver::topology_changed() { pipeline_->invalidate(); }
void btLazySoftBodySolver::use_motors_of(btMultiBodyDynamicsWorld* world) {
  pipeline_->use_motors_of(world);
}

void btLazySoftBodySolver::teleported(const btCollisionObject& body) {
  pipeline_->teleported(body);
}
void btLazySoftBodySolver::build_trees(btSoftBody& body) {
  SoftBodyDbvt::build_trees(body, face_tree_flag_vf_ss);
}

void btLazySoftBodySolver::handle_pair(btSoftBody* a, btSoftBody* b) {
  if (pipeline_->handle_pair(a, b)) return;
  dbvt_->update_trees(*a, *b);
  btDefaultSoftBodySolver::processCollision(a, b);
}

void btLazySoftBodySolver::predictMotion(btScalar solverdt) {
  LAZYCCD_BT_PROFILE("predict");
  pipeline_->begin_step(m_softBodySet, typeid(*this) != typeid(btLazySoftBodySolver));
  dbvt_->begin_prediction(m_softBodySet, face_tree_flag_vf_ss, !pipeline_->ran_last_step());
  predict(solverdt);
  dbvt_->end_prediction();
  // The contact lists of sleeping bodies stay as they are, as with Bullet.
  slept_.clear();
  for (int i = 0; i < m_softBodySet.size(); ++i) slept_.push_back(!m_softBodySet[i]->isActive());
}

void btLazySoftBodySolver::predict(btScalar time_step) {
  side_by_side_->begin(m_softBodySet, predicts_alone);
  const bool needs_nodes = !pipeline_->ran_last_step();
  const auto needs_trees = [needs_nodes](const btSoftBody& body) {
    return needs_nodes || body.m_bUpdateRtCst || !body.m_fdbvt.empty();
  };
  ScratchVector<btSoftBody*> without_trees;
  for (int i = 0; i < m_softBodySet.size() && !needs_nodes; ++i) {
    btSoftBody* const body = m_softBodySet[i];
    if (!body->isActive() || !needs_trees(*body)) without_trees.push_back(body);
  }
  predict_motions(m_softBodySet, *side_by_side_, [&](btSoftBody& body) {
    if (needs_trees(body)) {
      body.predictMotion(time_step);
    } else {
      predict_without_trees(body, time_step);
    }
  });
  dbvt_->leave_out_nodes(without_trees);
}

void btLazySoftBodySolver::processCollision(btSoftBody* body,
                                            const btCollisionObjectWrapper* other) {
  if (pipeline_->handle_pair(body, other->getCollisionObject())) return;
  dbvt_->update_trees(*body, *other->getCollisionObject());
  if (!body->isActive()) body->m_rcontacts.clear();  // Bullet does not clear those of a sleeper
  btDefaultSoftBodySolver::processCollision(body, other);
}

void btLazySoftBodySolver::processCollision(btSoftBody* a, btSoftBody* b) { handle_pair(a, b); }

void btLazySoftBodySolver::solveConstraints(btScalar solverdt) {
  // Drift iterations overwrite the start of the step in m_q, so copy it first.
  read_starts();
  {
    LAZYCCD_BT_PROFILE("links");
    constraints_->solve(m_softBodySet, side_by_side_->parallel_for(), side_by_side_->threads());
  }
  const auto fill = [this, solverdt](const SoftScene& scene, const SoftScene::BodyRecord& record,
                                     std::int32_t first, std::int32_t last, Motion& motion) {
    const std::vector<btVector3>& starts = starts_[record.world_index];
    // As in btSoftBody::solveConstraints(), with the body's own time step and damping. Without the
    // damping in this rate, a node that carries a load would leave the contact with the damped
    // fraction of the load's velocity.
    const btSoftBody::Config& config = record.body->m_cfg;
    const btScalar isdt = 1 / (solverdt * config.timescale);
    const double rate = static_cast<double>(isdt * (1 - config.kDP));
    const bool sleeps = starts.empty();
    for (std::int32_t v = first; v < last; ++v) {
      const int index = scene.node_index(v);
      const btSoftBody::Node& node = record.body->m_nodes[index];
      const btVector3& start = sleeps ? node.m_x : starts[index];
      for (int k = 0; k < 3; ++k) {
        motion.input().start[3 * static_cast<std::size_t>(v) + k] = start[k];
        motion.end[3 * static_cast<std::size_t>(v) + k] = node.m_x[k];
      }
      motion.input().velocity[v] = to_double(node.m_v);
      motion.input().rate[v] = rate;
    }
  };
  link_positions_.resize(starts_.size());
  LinkSolver links;
  links.again = [this](std::int32_t body) {
    return links_again(*pipeline_->scene().bodies()[body].body);
  };
  links.links = [this](std::int32_t body) { return scene_links_->of(pipeline_->scene(), body); };
  links.iterations = [this](std::int32_t body) {
    return pipeline_->scene().bodies()[body].body->m_cfg.piterations;
  };
  links.solve = [this](Span<const std::int32_t> bodies, double least, Motion& motion) {
    return solve_links(bodies, least, motion);
  };
  const bool ran =
      pipeline_->run(m_softBodySet, static_cast<double>(solverdt), fill, links, [this] {
        for (std::vector<btVector3>& positions : link_positions_) positions.clear();
        scene_links_->clear();  // bodies may have new indices
      });
  if (!ran) return;
  move_other_nodes(solverdt);
  if (pipeline_->responded()) write_back();
  pipeline_->detect_ahead();
  if (pipeline_->options().fill_contact_lists) fill_soft_contact_lists(pipeline_->contacts());
}

// The last call of a step, so on_contacts may remove bodies.
void btLazySoftBodySolver::updateSoftBodies() {
  LAZYCCD_BT_PROFILE("normals");
  normals_->update(m_softBodySet, side_by_side_->parallel_for());
  pipeline_->end_step();
}

void btLazySoftBodySolver::read_starts() {
  starts_.resize(m_softBodySet.size());
  for (int i = 0; i < m_softBodySet.size(); ++i) {
    btSoftBody& body = *m_softBodySet[i];
    starts_[i].clear();
    if (!body.isActive()) continue;
    if (i < static_cast<int>(slept_.size()) && slept_[i]) start_where_it_slept(body);
    starts_[i].resize(body.m_nodes.size());
    for (int j = 0; j < body.m_nodes.size(); ++j) starts_[i][j] = body.m_nodes[j].m_q;
  }
}

bool btLazySoftBodySolver::solve_links(Span<const std::int32_t> bodies, double least,
                                       Motion& motion) {
  LAZYCCD_BT_PROFILE("links");
  const SoftScene& scene = pipeline_->scene();
  // Calls each(vertex, position) with the positions of nodes that links have moved.
  const auto for_each_vertex = [&](std::int32_t index, const auto& each) {
    const SoftScene::BodyRecord& record = scene.bodies()[index];
    std::vector<btVector3>& positions = link_positions_[record.world_index];
    for (std::int32_t v = record.first_vertex; v < record.first_vertex + record.vertex_count; ++v)
      each(v, positions[static_cast<std::size_t>(scene.node_index(v))]);
  };
  double largest = 0;
  for (const std::int32_t index : bodies) {
    const SoftScene::BodyRecord& record = scene.bodies()[index];
    btSoftBody& body = *record.body;
    std::vector<btVector3>& positions = link_positions_[record.world_index];
    if (positions.empty())
      for (int i = 0; i < body.m_nodes.size(); ++i) positions.push_back(body.m_nodes[i].m_x);
    for_each_vertex(index, [&](std::int32_t v, btVector3& x) { x = to_bullet(motion.solved[v]); });
    constraints_->solve_links_again(body, record.world_index, positions);
    for_each_vertex(index, [&](std::int32_t v, const btVector3& x) {
      if (motion.is_free(v))
        largest = std::max(largest, (to_double(x) - motion.solved[v]).squaredNorm());
    });
  }
  if (largest < least * least) return false;
  motion.links_moved.resize(motion.rigid_of_body().size(), 0);
  for (const std::int32_t index : bodies) {
    motion.links_moved[index] = 1;
    for_each_vertex(index, [&](std::int32_t v, const btVector3& x) {
      if (!motion.is_free(v)) return;
      const Vector3d end = to_double(x);
      motion.link_displacement[v] += end - motion.solved[v];
      motion.solved[v] = end;
    });
  }
  return true;
}

void btLazySoftBodySolver::move_other_nodes(btScalar time_step) {
  const SoftScene& scene = pipeline_->scene();
  for (const SoftScene::BodyRecord& record : scene.bodies()) {
    const std::vector<btVector3>& positions = link_positions_[record.world_index];
    btSoftBody& body = *record.body;
    if (positions.empty() || record.vertex_count == body.m_nodes.size()) continue;
    const btScalar rate = (1 - body.m_cfg.kDP) / (time_step * body.m_cfg.timescale);
    for (int i = 0; i < body.m_nodes.size(); ++i) {
      if (scene.vertex_of(record, i) >= 0) continue;
      btSoftBody::Node& node = body.m_nodes[i];
      node.m_v += rate * (positions[static_cast<std::size_t>(i)] - node.m_x);
      node.m_x = positions[static_cast<std::size_t>(i)];
    }
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

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
