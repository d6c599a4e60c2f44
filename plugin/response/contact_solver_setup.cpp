// The problem of the contact solver: which rows take part, and their layout in batches.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "contact/rigid_terms.h"
#include "response/contact_solver.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// Split impulses stop at this fraction of corrected_gap, so that the tolerance of the velocity
// solve does not trigger them.
constexpr double split_fraction = 0.999;
// Indices of the displacements that a rigid body has.
constexpr std::int32_t translation_slot(std::int32_t body) {
  return 1 + RowBatch::vertices + 2 * body;
}
constexpr std::int32_t rotation_slot(std::int32_t body) { return translation_slot(body) + 1; }

// Sets the first three of four floats.
void set(float* to, const Vector3d& x) {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(x[k]);
}

// Displacement of one side relative to the other in the step, without the impulses of the problem.
Vector3d move_without_impulses(const ContactRow& row, bool for_split_impulse,
                               const Motion& motion) {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    const std::int32_t v = row.contact.vertices[k];
    Vector3d end = for_split_impulse && motion.is_free(v) ? motion.solved[v] : motion.predicted[v];
    if (!for_split_impulse && motion.is_free(v)) end += motion.link_displacement[v];
    sum += row.weights[k] * (end - motion.start_of(v));
  }
  if (!for_split_impulse) return sum;
  for (const RigidTerm& term : RigidTerms(row.contact, row.weights, motion)) {
    const RigidMotion& body = motion.rigid[term.body];
    sum += term.displacement(body.translation, body.rotation);
  }
  return sum;
}

RowEstimate estimate_for_target(const ContactRow& row, bool for_split_impulse,
                                const Motion& motion) {
  const Vector3d move = move_without_impulses(row, for_split_impulse, motion);
  RowEstimate estimate = estimate_row(row, move);
  if (for_split_impulse)
    estimate.need = split_fraction * row.corrected_gap - row.start_gap - row.normal.dot(move);
  return estimate;
}

// Visits rows in an order in which neighbours have no node in common. In the given order most
// neighbours share a node, and then only one of them would fit into a batch.
template <class Each>
void for_each_interleaved(const std::vector<std::int32_t>& rows, const Each& each) {
  constexpr std::size_t streams = 8;
  const std::size_t length = (rows.size() + streams - 1) / streams;
  for (std::size_t i = 0; i < length; ++i) {
    for (std::size_t k = i; k < rows.size(); k += length) each(rows[k]);
  }
}

}  // namespace

void ContactSolver::set_up(Target target, RowList& rows, const Motion& motion) {
  rows_ = &rows;
  motion_ = &motion;
  for_split_impulse_ = target == Target::split_impulse;
  length_unit_ = mass_unit_ = 1;
  max_violation_ = 0;
  needs_.resize(rows.size());
  row_batches_.begin(0);
  rigid_terms_.clear();
  bodies_.clear();
  couplings_.clear();
  batch_end_.clear();
  vertex_of_node_.clear();
  if (for_split_impulse_ && !classify_rows(true)) return;
  if (!classify_rows(false)) return;
  if (max_move_squared_ > 0) length_unit_ = std::sqrt(max_move_squared_);
  if (max_normal_mass_ > 0) mass_unit_ = max_normal_mass_;
  set_up_bodies();
  displacement_.assign(static_cast<std::size_t>(first_node()), Float4{});
  node_of_.assign(static_cast<std::size_t>(motion.soft_count()) + 1, 0);
  row_batches_.begin(displacement_.size() + node_of_.size());
  set_up_inactive();
  activate(initially_active_);
  for (std::size_t i = 0; i < batch_count(); ++i)
    kernels_->apply_impulses(problem(), static_cast<int>(i));
  activate_violated();
  max_violation_ =
      kernels_->max_violation(problem(), static_cast<int>(batch_count())) * length_unit_;
}

void ContactSolver::set_up_bodies() {
  for (const RigidMotion& rigid : motion_->rigid) {
    RowBody body = {};
    set(body.inverse_mass, mass_unit_ * rigid.inverse_mass);
    for (int k = 0; k < 3; ++k)
      set(body.inverse_inertia[k], mass_unit_ * rigid.inverse_inertia.col(k));
    bodies_.push_back(body);
  }
  for (const ArticulatedMotion& multibody : motion_->articulated) {
    for (const ArticulatedMotion::Link& pushed : multibody.links) {
      RowBody& body = bodies_[static_cast<std::size_t>(pushed.rigid)];
      body.first_coupling = static_cast<std::int32_t>(couplings_.size());
      for (const ArticulatedMotion::Link& moved : multibody.links) {
        const Eigen::Matrix<double, 6, 6> mobility = mass_unit_ * multibody.mobility(pushed, moved);
        RowCoupling coupling = {};
        for (int k = 0; k < 6; ++k) {
          set(coupling.translation_by[k], mobility.col(k).head<3>());
          set(coupling.rotation_by[k], mobility.col(k).tail<3>());
        }
        coupling.translation = translation_slot(moved.rigid);
        coupling.rotation = rotation_slot(moved.rigid);
        couplings_.push_back(coupling);
      }
      body.last_coupling = static_cast<std::int32_t>(couplings_.size());
    }
  }
}

std::int32_t ContactSolver::slot_of(int body) const {
  const int articulated = motion_->rigid[body].articulated;
  return translation_slot(articulated < 0 ? body
                                          : motion_->articulated[articulated].links.front().rigid);
}

bool ContactSolver::classify_rows(bool only_may_need_split) {
  max_need_ = max_move_squared_ = max_normal_mass_ = 0;
  initially_active_.clear();
  inactive_rows_.resize(needs_.size());
  std::size_t inactive_count = 0;
  const auto add = [&](std::size_t i, const RowEstimate& estimate, bool is_active) {
    needs_[i].displacement = estimate.need;
    max_need_ = std::max(max_need_, estimate.need);
    max_move_squared_ = std::max(max_move_squared_, estimate.move_squared);
    max_normal_mass_ = std::max(max_normal_mass_, estimate.normal_mass);
    if (is_active) {
      initially_active_.push_back(static_cast<std::int32_t>(i));
    } else {
      inactive_rows_[inactive_count++] = static_cast<std::int32_t>(i);
    }
  };
  for (std::size_t i = 0; i < needs_.size(); ++i) {
    bool& may_need_split = needs_[i].may_need_split;
    if (!rows_->can_act(i)) {
      may_need_split = false;
    } else if (!for_split_impulse_ && !rows_->is_made(i)) {
      may_need_split = rows_->estimate(i).may_need_split;
      add(i, rows_->estimate(i), false);
    } else if (may_need_split || !only_may_need_split) {
      const ContactRow& row = (*rows_)[i];
      if (!for_split_impulse_)
        may_need_split = row.corrected_gap > row.target_gap || row.split_impulse != 0;
      add(i, estimate_for_target(row, for_split_impulse_, *motion_), has_impulse(row));
    }
  }
  inactive_rows_.resize(inactive_count);
  return !initially_active_.empty() || max_need_ >= min_speed * motion_->dt;
}

void ContactSolver::set_up_inactive() {
  const std::size_t count = inactive_rows_.size();
  inactive_.resize((count + InactiveBatch::lanes - 1) / InactiveBatch::lanes);
  if (count > 0) inactive_.back() = InactiveBatch{};  // not all of its lanes may be filled
  const bool has_rigid_terms = !motion_->rigid.empty() || !motion_->anchored.empty();
  for (std::size_t n = 0; n < count; ++n) {
    InactiveBatch& batch = inactive_[n / InactiveBatch::lanes];
    const int lane = static_cast<int>(n % InactiveBatch::lanes), at = 4 * lane;
    if (lane == 0) batch.first_term = static_cast<std::int32_t>(rigid_terms_.size());
    const auto i = static_cast<std::size_t>(inactive_rows_[n]);
    const Contact& contact = rows_->contact(i);
    const std::array<double, 4> weights = contact.weights();
    std::copy(contact.normal.begin(), contact.normal.end(), batch.normal + at);
    batch.normal[at + 3] = static_cast<float>(needs_[i].displacement / length_unit_);
    for (int k = 0; k < 4; ++k) {
      batch.weight[at + k] = static_cast<float>(weights[k]);
      batch.vertex[at + k] = std::min(contact.vertices[k], motion_->soft_count());
    }
    if (has_rigid_terms) add_rigid_terms(contact, weights, lane);
    batch.last_term = static_cast<std::int32_t>(rigid_terms_.size());
  }
}

void ContactSolver::find_violated() {
  violated_.resize(InactiveBatch::lanes * inactive_.size());
  violated_.resize(static_cast<std::size_t>(
      kernels_->find_violated(problem(), node_of_.data(), inactive_.data(),
                              static_cast<int>(inactive_.size()), violated_.data())));
}

bool ContactSolver::activate_violated() {
  find_violated();
  for (std::int32_t& i : violated_) {
    // A row that is in the problem is never found again.
    inactive_[i / InactiveBatch::lanes].normal[4 * (i % InactiveBatch::lanes) + 3] =
        std::numeric_limits<float>::lowest();
    i = inactive_rows_[i];
  }
  activate(violated_);
  return !violated_.empty();
}

void ContactSolver::activate(const Indices& indices) {
  RowList& rows = *rows_;
  const Motion& motion = *motion_;
  std::size_t b = batch_count();
  for_each_interleaved(indices, [&](std::int32_t i) {
    needs_[i].may_need_split = true;
    const ContactRow& row = rows[i];
    std::array<std::int32_t, RowBatches::max_slots> slots;
    std::int32_t* last = slots.data();
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = row.contact.vertices[k];
      if (row.weights[k] * motion.inverse_mass_of(v) == 0) continue;
      if (node_of_[v] == 0) {
        node_of_[v] = first_node() + static_cast<std::int32_t>(vertex_of_node_.size());
        vertex_of_node_.push_back(v);
      }
      *last++ = node_of_[v];
    }
    for (const RigidTerm& term : RigidTerms(row.contact, row.weights, motion))
      *last++ = slot_of(term.body);
    row_batches_.add(i, slots.data(), last);
  });
  row_batches_.finish();
  displacement_.resize(static_cast<std::size_t>(first_node()) + vertex_of_node_.size());
  if (batches_.size() < batch_count()) batches_.resize(batch_count());
  for (; b < batch_count(); ++b) {
    const RowBatches::Batch& batch_rows = row_batches_.batches()[b];
    RowBatch& batch = batches_[b];
    if (batch_rows.back() == RowBatches::none) {
      batch = {};
      std::iota(std::begin(batch.scatter_node), std::end(batch.scatter_node), 1);
    }
    std::int32_t end = first_node();
    batch.first_term = static_cast<std::int32_t>(rigid_terms_.size());
    for (int lane = 0; lane < RowBatch::lanes && batch_rows[lane] != RowBatches::none; ++lane) {
      fill(batch, lane, rows[batch_rows[lane]], needs_[batch_rows[lane]]);
      for (int k = 0; k < 4; ++k) end = std::max(end, batch.node[4 * lane + k] + 1);
    }
    batch.last_term = static_cast<std::int32_t>(rigid_terms_.size());
    std::copy(std::begin(batch.impulse), std::end(batch.impulse), batch.last_impulse);
    batch_end_.push_back(end);
  }
}

void ContactSolver::fill(RowBatch& batch, int lane, const ContactRow& row, const RowNeed& need) {
  const int at = 4 * lane;
  const double unit = 1 / (mass_unit_ * length_unit_);
  const Vector3d move = move_without_impulses(row, for_split_impulse_, *motion_);
  set(batch.normal + at, row.normal);
  set(batch.tangent_move + at, (move - row.normal.dot(move) * row.normal) / length_unit_);
  batch.sliding_fraction[lane] = for_split_impulse_ ? 0 : static_cast<float>(row.sliding_fraction);
  batch.tangent_move[at + 3] = batch.sliding_fraction[lane];
  set(batch.impulse + at, (for_split_impulse_ ? 0 : unit) * row.tangent_impulse);
  batch.impulse[at + 3] =
      static_cast<float>(unit * (for_split_impulse_ ? row.split_impulse : row.normal_impulse));
  float* const terms = batch.terms + at;
  terms[0] = static_cast<float>(need.displacement / length_unit_);
  terms[1] = static_cast<float>(row.normal_mass / mass_unit_);
  terms[2] = for_split_impulse_ ? 0 : static_cast<float>(row.friction);
  terms[3] = static_cast<float>(row.tangent_mass / mass_unit_);
  float* const compliance = batch.compliance + at;
  compliance[0] = compliance[1] = compliance[2] = static_cast<float>(mass_unit_ / row.tangent_mass);
  compliance[3] = static_cast<float>(mass_unit_ / row.normal_mass);
  for (int k = 0; k < 4; ++k) {
    const std::int32_t v = row.contact.vertices[k];
    batch.weight[at + k] = static_cast<float>(row.weights[k]);
    batch.mobility[at + k] =
        static_cast<float>(row.weights[k] * motion_->inverse_mass_of(v) * mass_unit_);
    const bool moves = batch.mobility[at + k] != 0;
    batch.node[at + k] = moves ? node_of_[v] : 0;
    batch.scatter_node[at + k] = moves ? node_of_[v] : 1 + at + k;
  }
  add_rigid_terms(row.contact, row.weights, lane);
}

void ContactSolver::add_rigid_terms(const Contact& contact, const std::array<double, 4>& weights,
                                    int lane) {
  for (const RigidTerm& term : RigidTerms(contact, weights, *motion_)) {
    RowRigidTerm p = {};
    set(p.arm, term.arm);
    p.weight = static_cast<float>(term.weight);
    p.lane = lane;
    p.body = term.body;
    p.translation = translation_slot(term.body);
    p.rotation = rotation_slot(term.body);
    rigid_terms_.push_back(p);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
