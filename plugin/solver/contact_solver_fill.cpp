// The batches of a block of rows.
#include <algorithm>
#include <numeric>

#include "solver/contact_solver_parts.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

namespace {

// How far the surfaces of conveyors move along under the contact in the step, as a part of the
// relative displacement of its sides, metres. Only friction sees it.
Vector3d conveyor_displacement(const ContactRow& row, const Motion& motion) {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    const std::int32_t body =
        k < first_vertex_of_b(row.contact.kind) ? row.contact.body_a : row.contact.body_b;
    const int rigid = motion.rigid_of_body()[body];
    if (rigid < 0 || !motion.rigid()[rigid].is_conveyor) continue;
    const Vector3d point = motion.start_of(row.contact.vertices[k]);
    sum += motion.dt() * row.weights[k] * motion.rigid()[rigid].velocity_at(point);
  }
  return sum;
}

}  // namespace

void ContactSolver::fill(RowBlock& block, Scratch& scratch) {
  for (const std::int32_t i : block.new_rows) rows_->make_placed(i);
  RowBatches& batches = scratch.batches;
  batches.begin(displacement_.size());
  for (const std::int32_t i : block.rows) {
    const ContactRow& row = (*rows_)[i];
    std::array<std::int32_t, RowBatches::max_slots> slots;
    std::int32_t* last = slots.data();
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = row.contact.vertices[k];
      if (row.weights[k] * motion_->inverse_mass_of(v) != 0) *last++ = node_of_[v];
    }
    batches.add(i, slots.data(), last);
  }
  batches.finish();
  block.batch_rows = batches.batches();
  block.batches.resize(block.batch_rows.size());
  block.terms.clear();
  block.active.resize(block.batches.size());
  std::iota(block.active.begin(), block.active.end(), 0);
  map_copies(block, scratch);
  for (std::size_t b = 0; b < block.batches.size(); ++b)
    fill(block, block.batch_rows[b], block.batches[b], scratch.copy_of);
  unmap_copies(block, scratch);
}

void ContactSolver::map_copies(const RowBlock& block, Scratch& scratch) const {
  for (std::size_t i = 0; i < block.shared.size(); ++i)
    scratch.copy_of[block.shared[i]] = block.copy(i);
}

void ContactSolver::unmap_copies(const RowBlock& block, Scratch& scratch) const {
  for (const std::int32_t slot : block.shared) scratch.copy_of[slot] = 0;
}

void ContactSolver::fill(RowBlock& block, const RowBatches::Batch& rows, RowBatch& batch,
                         const Indices& copy_of) {
  batch = {};
  for (int i = 0; i < RowBatch::vertices; ++i) batch.scatter_node[i] = block.first_own + i;
  batch.first_term = static_cast<std::int32_t>(block.terms.size());
  // By lane: what the splitting of masses adds to the compliance along the normal and across it.
  std::array<double, RowBatch::lanes> extra_normal = {}, extra_tangent = {};
  if (has_rigid_terms_) {
    struct LaneTerm {
      int lane;
      RigidTerm term;
    };
    std::array<LaneTerm, 4 * RowBatch::lanes> terms;
    int count = 0;
    for (int lane = 0; lane < RowBatch::lanes && rows[lane] != RowBatches::none; ++lane) {
      const ContactRow& row = (*rows_)[rows[lane]];
      for (const RigidTerm& term : RigidTerms(row.contact, row.weights, *motion_)) {
        terms[count++] = {lane, term};
        RowRigidTerm& made = block.terms.emplace_back(make_term(term, lane));
        if (const std::int32_t copy = copy_of[made.translation]) {
          made.body = row_body_of_[term.body];
          made.translation = copy;
          made.rotation = copy + 1;
        }
      }
    }
    // All links of a multibody count as one body. Only one block moves it.
    const auto are_one_body = [this](int a, int b) {
      const int multibody = motion_->rigid()[a].articulated;
      return a == b || (multibody >= 0 && multibody == motion_->rigid()[b].articulated);
    };
    for (int i = 0; i < count; ++i) {
      const RigidTerm& term = terms[i].term;
      const auto lanes = std::count_if(
          terms.begin(), terms.begin() + count,
          [&](const auto& other) { return are_one_body(term.body, other.term.body); });
      const bool is_link = motion_->rigid()[term.body].articulated >= 0;
      const double split =
          static_cast<double>(lanes) * (is_link ? 1 : sharers_[translation_slot(term.body)]);
      if (split == 1) continue;
      const ContactRow& row = (*rows_)[rows[terms[i].lane]];
      const Matrix3d mobility = term.mobility(*motion_);
      const double normal = row.normal.dot(mobility * row.normal);
      extra_normal[terms[i].lane] += (split - 1) * normal;
      extra_tangent[terms[i].lane] += (split - 1) * std::max(0.0, mobility.trace() - normal);
    }
  }
  batch.last_term = static_cast<std::int32_t>(block.terms.size());
  const auto is_before = [](const RowRigidTerm& a, const RowRigidTerm& b) {
    return a.translation < b.translation;
  };
  const auto first_term = block.terms.begin() + batch.first_term;
  for (auto term = first_term; term != block.terms.end(); ++term)  // insertion sort of a few
    std::rotate(std::upper_bound(first_term, term, *term, is_before), term, term + 1);
  for (int lane = 0; lane < RowBatch::lanes && rows[lane] != RowBatches::none; ++lane)
    fill(batch, lane, problems_[block.island], (*rows_)[rows[lane]], extra_normal[lane],
         extra_tangent[lane], needs_[rows[lane]], copy_of);
  bound_sliding(batch);
  std::copy(std::begin(batch.impulse), std::end(batch.impulse), batch.last_impulse);
}

void ContactSolver::fill(RowBatch& batch, int lane, const Problem& problem, const ContactRow& row,
                         double extra_normal, double extra_tangent, double need,
                         const Indices& copy_of) const {
  const int at = 4 * lane;
  const double length_unit = problem.length_unit, mass_unit = problem.mass_unit;
  const double unit = 1 / (mass_unit * length_unit);
  const Vector3d move = move_without_impulses(row, for_split_impulse_, *motion_);
  set(batch.normal + at, row.normal);
  const Vector3d slide = move + conveyor_displacement(row, *motion_);
  set(batch.tangent_move + at, (slide - row.normal.dot(slide) * row.normal) / length_unit);
  const float sliding = for_split_impulse_ ? 0 : static_cast<float>(row.sliding_fraction);
  batch.slides = batch.slides || sliding != 0;
  batch.sliding[at + 3] = sliding;
  set(batch.impulse + at, (for_split_impulse_ ? 0 : unit) * row.tangent_impulse);
  batch.impulse[at + 3] =
      static_cast<float>(unit * (for_split_impulse_ ? row.split_impulse : row.normal_impulse));
  for (int k = 0; k < 4; ++k) {
    const std::int32_t v = row.contact.vertices[k];
    const double inverse_mass = motion_->inverse_mass_of(v);
    batch.weight[at + k] = static_cast<float>(row.weights[k]);
    if (row.weights[k] * inverse_mass == 0) continue;
    const std::int32_t slot = node_of_[v];
    const double split = sharers_[slot];
    const double extra = (split - 1) * row.weights[k] * row.weights[k] * inverse_mass;
    extra_normal += extra;
    extra_tangent += extra;
    batch.mobility[at + k] = static_cast<float>(split * row.weights[k] * inverse_mass * mass_unit);
    batch.node[at + k] = batch.scatter_node[at + k] = copy_of[slot] != 0 ? copy_of[slot] : slot;
  }
  const double normal_mass =
                   extra_normal > 0 ? 1 / (1 / row.normal_mass + extra_normal) : row.normal_mass,
               tangent_mass = extra_tangent > 0 ? 1 / (1 / row.tangent_mass + extra_tangent)
                                                : row.tangent_mass;
  float* const terms = batch.terms + at;
  terms[0] = static_cast<float>(need / length_unit);
  terms[1] = static_cast<float>(normal_mass / mass_unit);
  terms[2] = for_split_impulse_ ? 0 : static_cast<float>(row.friction);
  terms[3] = static_cast<float>(tangent_mass / mass_unit);
  float* const compliance = batch.compliance + at;
  compliance[0] = compliance[1] = compliance[2] = static_cast<float>(mass_unit / tangent_mass);
  compliance[3] = static_cast<float>(mass_unit / normal_mass);
}

void ContactSolver::bound_sliding(RowBatch& batch) const {
  for (int at = 3; at < 4 * RowBatch::lanes; at += 4) {
    batch.tangent_move[at] = batch.sliding[at];
    if (batch.sliding[at] == 0 || manner_ == Manner::full) continue;
    const Vector3d impulse = vector_of(batch.impulse + at - 3);
    if (!impulse.isZero()) batch.tangent_move[at] = -static_cast<float>(impulse.norm());
  }
}

RowRigidTerm ContactSolver::make_term(const RigidTerm& term, int lane) const {
  RowRigidTerm made = {};
  set(made.arm, term.arm);
  made.weight = static_cast<float>(term.weight);
  made.lane = lane;
  made.body = term.body;
  made.translation = translation_slot(term.body);
  made.rotation = made.translation + 1;
  return made;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
