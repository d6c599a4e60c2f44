// The problem of the contact solver: which rows take part, and their layout in blocks.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "contact/rigid_terms.h"
#include "response/contact_solver.h"
#include "response/contact_solver_phases.h"
#include "util/spatial_order.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// Split impulses stop at this fraction of corrected_gap, so that the tolerance of the velocity
// solve does not trigger them.
constexpr double split_fraction = 0.999;
// Largest growth of a row's compliance by the splitting of masses, as a fraction.
constexpr double max_split_growth = 0.5;
// Most blocks of a colour that move the same body, whatever its mass.
constexpr int max_shared_limit = 1 << 12;

// Indices of the displacements that a rigid body has.
constexpr std::int32_t translation_slot(std::int32_t body) { return 1 + 2 * body; }

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

}  // namespace

void ContactSolver::Largest::include(const Largest& other) {
  need = std::max(need, other.need);
  move_squared = std::max(move_squared, other.move_squared);
  normal_mass = std::max(normal_mass, other.normal_mass);
}

void ContactSolver::set_up(Target target, RowList& rows, const Motion& motion) {
  rows_ = &rows;
  motion_ = &motion;
  for_split_impulse_ = target == Target::split_impulse;
  has_rigid_terms_ = !motion.rigid.empty() || !motion.anchored.empty();
  length_unit_ = mass_unit_ = 1;
  max_violation_ = 0;
  needs_.resize(rows.size());
  block_count_ = 0;
  for (Indices& blocks : blocks_of_colour_) blocks.clear();
  shared_.clear();
  bodies_.clear();
  couplings_.clear();
  vertex_of_node_.clear();
  if (for_split_impulse_ && !classify_rows(true)) return;
  if (!classify_rows(false)) return;
  if (largest_.move_squared > 0) length_unit_ = std::sqrt(largest_.move_squared);
  if (largest_.normal_mass > 0) mass_unit_ = largest_.normal_mass;
  set_up_bodies();
  colours_.begin();
  displacement_.assign(1 + 2 * bodies_.size(), Float4{});
  node_of_.assign(static_cast<std::size_t>(motion.soft_count()) + 1, 0);
  if (scratch_.empty()) scratch_.resize(static_cast<std::size_t>(threads_.count()));
  for_each(chunk_count_, [this](std::size_t i, int) { set_up_inactive(chunks_[i]); });

  const auto add = [this](Indices&& indices) {
    const std::size_t first = add_blocks(indices);
    for_each(block_count_ - first, [&](std::size_t i, int worker) {
      fill(blocks_[first + i], scratch_[static_cast<std::size_t>(worker)]);
    });
  };
  Indices initially_active;
  for (std::size_t i = 0; i < chunk_count_; ++i)
    initially_active.insert(initially_active.end(), chunks_[i].active.begin(),
                            chunks_[i].active.end());
  add(std::move(initially_active));
  for_each_block_by_colour(
      [this](RowBlock& block, int) {
        read_bodies(block);
        for (std::size_t i = 0; i < block.batches.size(); ++i)
          kernels_->apply_impulses(problem_of(block), static_cast<int>(i));
      },
      [this](const Indices& blocks) { merge_bodies(blocks); });
  for_each(chunk_count_, [this](std::size_t i, int) { find_violated(chunks_[i]); });
  add(take_violated());

  for_each(block_count_, [this](std::size_t i, int) {
    RowBlock& block = blocks_[i];
    read_bodies(block);
    block.violation =
        kernels_->max_violation(problem_of(block), static_cast<int>(block.batches.size()));
  });
  for (std::size_t i = 0; i < block_count_; ++i)
    max_violation_ =
        std::max(max_violation_, static_cast<double>(blocks_[i].violation) * length_unit_);
}

void ContactSolver::set_up_bodies() {
  for (const RigidMotion& rigid : motion_->rigid) {
    RowBody body = {};
    set(body.inverse_mass, mass_unit_ * rigid.inverse_mass);
    for (int k = 0; k < 3; ++k)
      set(body.inverse_inertia[k], mass_unit_ * rigid.inverse_inertia.col(k));
    bodies_.push_back(body);
  }
  shared_of_.assign(bodies_.size(), -1);
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
        coupling.rotation = coupling.translation + 1;
        couplings_.push_back(coupling);
      }
      body.last_coupling = static_cast<std::int32_t>(couplings_.size());
    }
  }
}

std::int32_t ContactSolver::slot_of_multibody(int rigid) const {
  const ArticulatedMotion& multibody = motion_->articulated[motion_->rigid[rigid].articulated];
  return translation_slot(multibody.links.front().rigid);
}

bool ContactSolver::classify_rows(bool only_may_need_split) {
  const std::size_t count = needs_.size();
  chunk_count_ = (count + RowChunk::rows - 1) / RowChunk::rows;
  if (chunks_.size() < chunk_count_) chunks_.resize(chunk_count_);
  for_each(chunk_count_, [&](std::size_t i, int) {
    const std::size_t first = i * RowChunk::rows;
    classify(chunks_[i], first, std::min(first + RowChunk::rows, count), only_may_need_split);
  });
  largest_ = {};
  bool any_active = false;
  for (std::size_t i = 0; i < chunk_count_; ++i) {
    largest_.include(chunks_[i].largest);
    any_active = any_active || !chunks_[i].active.empty();
  }
  return any_active || largest_.need >= min_speed * motion_->dt;
}

void ContactSolver::classify(RowChunk& chunk, std::size_t first, std::size_t last,
                             bool only_may_need_split) {
  chunk.largest = {};
  chunk.active.clear();
  chunk.inactive.clear();
  const auto add = [&](std::size_t i, const RowEstimate& estimate, bool is_active) {
    needs_[i].displacement = estimate.need;
    chunk.largest.include({estimate.need, estimate.move_squared, estimate.normal_mass});
    (is_active ? chunk.active : chunk.inactive).push_back(static_cast<std::int32_t>(i));
  };
  for (std::size_t i = first; i < last; ++i) {
    bool& may_need_split = needs_[i].may_need_split;
    if (!rows_->can_act(i)) {
      may_need_split = false;
    } else if (!for_split_impulse_ && !rows_->is_made(i)) {
      may_need_split = rows_->estimate(i).may_need_split;
      add(i, rows_->estimate(i), false);
    } else if (may_need_split || !only_may_need_split) {
      ContactRow scratch;
      const ContactRow& row = rows_->get(i, scratch);
      if (!for_split_impulse_)
        may_need_split = row.corrected_gap > row.target_gap || row.split_impulse != 0;
      add(i, estimate_for_target(row, for_split_impulse_, *motion_), has_impulse(row));
    }
  }
}

void ContactSolver::set_up_inactive(RowChunk& chunk) {
  const std::size_t count = chunk.inactive.size();
  chunk.batches.resize((count + InactiveBatch::lanes - 1) / InactiveBatch::lanes);
  chunk.terms.clear();
  if (count > 0) chunk.batches.back() = InactiveBatch{};  // not all of its lanes may be filled
  for (std::size_t n = 0; n < count; ++n) {
    InactiveBatch& batch = chunk.batches[n / InactiveBatch::lanes];
    const int lane = static_cast<int>(n % InactiveBatch::lanes), at = 4 * lane;
    if (lane == 0) batch.first_term = static_cast<std::int32_t>(chunk.terms.size());
    const auto i = static_cast<std::size_t>(chunk.inactive[n]);
    const Contact& contact = rows_->contact(i);
    const std::array<double, 4> weights = contact.weights();
    std::copy(contact.normal.begin(), contact.normal.end(), batch.normal + at);
    batch.normal[at + 3] = static_cast<float>(needs_[i].displacement / length_unit_);
    for (int k = 0; k < 4; ++k) {
      batch.weight[at + k] = static_cast<float>(weights[k]);
      batch.vertex[at + k] = std::min(contact.vertices[k], motion_->soft_count());
    }
    if (has_rigid_terms_) {
      for (const RigidTerm& term : RigidTerms(contact, weights, *motion_))
        chunk.terms.push_back(make_term(term, lane, nullptr));
    }
    batch.last_term = static_cast<std::int32_t>(chunk.terms.size());
  }
}

void ContactSolver::find_violated(RowChunk& chunk) {
  PgsProblem problem = {};
  problem.rigid_terms = chunk.terms.data();
  problem.displacement = displacement_.data();
  chunk.violated.resize(InactiveBatch::lanes * chunk.batches.size());
  chunk.violated.resize(static_cast<std::size_t>(
      kernels_->find_violated(problem, node_of_.data(), chunk.batches.data(),
                              static_cast<int>(chunk.batches.size()), chunk.violated.data())));
}

ContactSolver::Indices ContactSolver::take_violated() {
  Indices rows;
  for (std::size_t c = 0; c < chunk_count_; ++c) {
    RowChunk& chunk = chunks_[c];
    for (const std::int32_t i : chunk.violated) {
      // A row that is in the problem is never found again.
      chunk.batches[i / InactiveBatch::lanes].normal[4 * (i % InactiveBatch::lanes) + 3] =
          std::numeric_limits<float>::lowest();
      rows.push_back(chunk.inactive[i]);
    }
  }
  return rows;
}

std::size_t ContactSolver::add_blocks(Indices& rows) {
  const std::size_t first_block = block_count_;
  if (rows.empty()) return first_block;
  if (rows.size() > RowBlock::max_rows) sort_by_place(rows);
  block_count_ += (rows.size() + RowBlock::max_rows - 1) / RowBlock::max_rows;
  if (blocks_.size() < block_count_) blocks_.resize(block_count_);
  std::vector<double> shares(has_rigid_terms_ ? motion_->rigid.size() : 0, 0);
  auto next = rows.begin();
  for (std::size_t b = first_block; b < block_count_; ++b) {
    const auto last = next + std::min<std::ptrdiff_t>(RowBlock::max_rows, rows.end() - next);
    blocks_[b].rows.assign(next, last);
    next = last;
    find_slots(blocks_[b], shares);
  }
  share_bodies(first_block, shares);
  colour_blocks(first_block);
  return first_block;
}

void ContactSolver::sort_by_place(Indices& rows) {
  const Motion& motion = *motion_;
  if (rank_.size() != static_cast<std::size_t>(motion.soft_count())) {
    const std::vector<std::int32_t> order =
        spatial_order(static_cast<std::size_t>(motion.soft_count()),
                      [&](std::int32_t v) { return motion.start_of(v); });
    rank_.resize(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) rank_[order[i]] = static_cast<std::int32_t>(i);
  }
  const auto place_of = [&](std::int32_t row) {
    const Contact& contact = rows_->contact(static_cast<std::size_t>(row));
    for (const std::int32_t v : contact.vertices)
      if (motion.is_soft(v)) return rank_[v];
    return 0;
  };
  std::vector<std::uint64_t> keys;
  keys.reserve(rows.size());
  for (const std::int32_t row : rows)
    keys.push_back(static_cast<std::uint64_t>(place_of(row)) << 32 |
                   static_cast<std::uint32_t>(row));
  std::sort(keys.begin(), keys.end());
  for (std::size_t i = 0; i < keys.size(); ++i)
    rows[i] = static_cast<std::int32_t>(keys[i] & 0xffffffff);
}

void ContactSolver::find_slots(RowBlock& block, std::vector<double>& shares) {
  block.new_rows.clear();
  block.slots.clear();
  block.bodies.clear();
  for (const std::int32_t i : block.rows) {
    needs_[i].may_need_split = true;
    const bool is_made = rows_->is_made(i);
    const Contact& contact = rows_->contact(i);
    const std::array<double, 4> weights = contact.weights();
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = contact.vertices[k];
      if (weights[k] * motion_->inverse_mass_of(v) == 0) continue;
      if (node_of_[v] == 0) {
        node_of_[v] = displacement_count();
        displacement_.push_back({});
        vertex_of_node_.push_back(v);
      }
      block.slots.push_back(node_of_[v]);
    }
    if (has_rigid_terms_) {
      const double normal_mass = is_made ? (*rows_)[i].normal_mass : rows_->estimate(i).normal_mass;
      for (const RigidTerm& term : RigidTerms(contact, weights, *motion_)) {
        const RigidMotion& rigid = motion_->rigid[term.body];
        if (rigid.articulated >= 0) {
          block.slots.push_back(slot_of_multibody(term.body));
          continue;
        }
        if (std::find(block.bodies.begin(), block.bodies.end(), term.body) == block.bodies.end())
          block.bodies.push_back(term.body);
        // An upper bound of the body's part of the row's compliance.
        const double compliance = term.weight * term.weight * rigid.inverse_mass.maxCoeff() +
                                  term.arm.squaredNorm() * rigid.inverse_inertia.trace();
        shares[term.body] = std::max(shares[term.body], compliance * normal_mass);
      }
    }
    if (is_made) continue;
    rows_->place(i);
    block.new_rows.push_back(i);
  }
}

void ContactSolver::share_bodies(std::size_t first_block, const std::vector<double>& shares) {
  for (std::size_t b = first_block; b < block_count_; ++b) {
    RowBlock& block = blocks_[b];
    for (int& body : block.bodies) {
      std::int32_t& index = shared_of_[body];
      if (index < 0) {
        const double most = max_split_growth / std::max(shares[body], 1e-9);
        const int split = static_cast<int>(
            std::min<double>(1 + most, static_cast<double>(RowBatch::lanes) * max_shared_limit));
        const bool in_lanes = split >= RowBatch::lanes;
        index = colours_.add_body(in_lanes ? split / RowBatch::lanes : split);
        shared_.push_back({body, 0, in_lanes, {}});
      }
      body = index;
    }
  }
}

void ContactSolver::colour_blocks(std::size_t first_block) {
  const std::size_t known_bodies = static_cast<std::size_t>(std::count_if(
      shared_.begin(), shared_.end(), [](const SharedBody& body) { return body.limit > 0; }));
  colours_.grow(displacement_.size());
  for (std::size_t b = first_block; b < block_count_; ++b) {
    RowBlock& block = blocks_[b];
    block.colour = colours_.add_block(block.slots, block.bodies);
    blocks_of_colour_[block.colour].push_back(static_cast<std::int32_t>(b));
    block.first_own = displacement_count();
    displacement_.resize(displacement_.size() + RowBatch::vertices + 2 * block.bodies.size());
  }
  // The blocks that come first decide how light a body is taken for. Later ones keep to that.
  for (std::size_t i = known_bodies; i < shared_.size(); ++i) {
    SharedBody& shared = shared_[i];
    shared.limit = colours_.close_body(static_cast<int>(i));
    RowBody& body = bodies_[shared.rigid];
    for (float& x : body.inverse_mass) x *= static_cast<float>(shared.limit);
    for (auto& column : body.inverse_inertia)
      for (float& x : column) x *= static_cast<float>(shared.limit);
  }
}

void ContactSolver::fill(RowBlock& block, RowBatches& scratch) {
  for (const std::int32_t i : block.new_rows) rows_->make_placed(i);
  scratch.begin(displacement_.size());
  for (const std::int32_t i : block.rows) {
    const ContactRow& row = (*rows_)[i];
    std::array<std::int32_t, RowBatches::max_slots> slots;
    std::int32_t* last = slots.data();
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = row.contact.vertices[k];
      if (row.weights[k] * motion_->inverse_mass_of(v) != 0) *last++ = node_of_[v];
    }
    if (has_rigid_terms_) {
      for (const RigidTerm& term : RigidTerms(row.contact, row.weights, *motion_)) {
        if (motion_->rigid[term.body].articulated >= 0) {
          *last++ = slot_of_multibody(term.body);
        } else if (!shared_[shared_of_[term.body]].in_lanes) {
          *last++ = translation_slot(term.body);
        }
      }
    }
    scratch.add(i, slots.data(), last);
  }
  scratch.finish();
  block.batch_rows = scratch.batches();
  block.batches.resize(block.batch_rows.size());
  block.terms.clear();
  block.active.resize(block.batches.size());
  std::iota(block.active.begin(), block.active.end(), 0);
  for (std::size_t b = 0; b < block.batches.size(); ++b)
    fill(block, block.batch_rows[b], block.batches[b]);
}

void ContactSolver::fill(RowBlock& block, const RowBatches::Batch& rows, RowBatch& batch) {
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
        block.terms.push_back(make_term(term, lane, &block));
      }
    }
    for (int i = 0; i < count; ++i) {
      const RigidTerm& term = terms[i].term;
      if (motion_->rigid[term.body].articulated >= 0) continue;
      const auto lanes = std::count_if(terms.begin(), terms.begin() + count,
                                       [&](const auto& t) { return t.term.body == term.body; });
      const double split = static_cast<double>(lanes) * shared_[shared_of_[term.body]].limit;
      if (split == 1) continue;
      const ContactRow& row = (*rows_)[rows[terms[i].lane]];
      const Eigen::Matrix3d mobility = term.mobility(*motion_);
      const double normal = row.normal.dot(mobility * row.normal);
      extra_normal[terms[i].lane] += (split - 1) * normal;
      extra_tangent[terms[i].lane] += (split - 1) * std::max(0.0, mobility.trace() - normal);
    }
  }
  batch.last_term = static_cast<std::int32_t>(block.terms.size());
  for (int lane = 0; lane < RowBatch::lanes && rows[lane] != RowBatches::none; ++lane)
    fill(batch, lane, (*rows_)[rows[lane]], extra_normal[lane], extra_tangent[lane],
         needs_[rows[lane]].displacement);
  std::copy(std::begin(batch.impulse), std::end(batch.impulse), batch.last_impulse);
}

void ContactSolver::fill(RowBatch& batch, int lane, const ContactRow& row, double extra_normal,
                         double extra_tangent, double need) const {
  const int at = 4 * lane;
  const double unit = 1 / (mass_unit_ * length_unit_);
  const Vector3d move = move_without_impulses(row, for_split_impulse_, *motion_);
  set(batch.normal + at, row.normal);
  set(batch.tangent_move + at, (move - row.normal.dot(move) * row.normal) / length_unit_);
  const float sliding = for_split_impulse_ ? 0 : static_cast<float>(row.sliding_fraction);
  batch.slides = batch.slides || sliding != 0;
  batch.tangent_move[at + 3] = batch.sliding[at + 3] = sliding;
  set(batch.impulse + at, (for_split_impulse_ ? 0 : unit) * row.tangent_impulse);
  batch.impulse[at + 3] =
      static_cast<float>(unit * (for_split_impulse_ ? row.split_impulse : row.normal_impulse));
  const double normal_mass =
                   extra_normal > 0 ? 1 / (1 / row.normal_mass + extra_normal) : row.normal_mass,
               tangent_mass = extra_tangent > 0 ? 1 / (1 / row.tangent_mass + extra_tangent)
                                                : row.tangent_mass;
  float* const terms = batch.terms + at;
  terms[0] = static_cast<float>(need / length_unit_);
  terms[1] = static_cast<float>(normal_mass / mass_unit_);
  terms[2] = for_split_impulse_ ? 0 : static_cast<float>(row.friction);
  terms[3] = static_cast<float>(tangent_mass / mass_unit_);
  float* const compliance = batch.compliance + at;
  compliance[0] = compliance[1] = compliance[2] = static_cast<float>(mass_unit_ / tangent_mass);
  compliance[3] = static_cast<float>(mass_unit_ / normal_mass);
  for (int k = 0; k < 4; ++k) {
    const std::int32_t v = row.contact.vertices[k];
    batch.weight[at + k] = static_cast<float>(row.weights[k]);
    batch.mobility[at + k] =
        static_cast<float>(row.weights[k] * motion_->inverse_mass_of(v) * mass_unit_);
    if (batch.mobility[at + k] != 0) batch.node[at + k] = batch.scatter_node[at + k] = node_of_[v];
  }
}

RowRigidTerm ContactSolver::make_term(const RigidTerm& term, int lane,
                                      const RowBlock* block) const {
  RowRigidTerm made = {};
  set(made.arm, term.arm);
  made.weight = static_cast<float>(term.weight);
  made.lane = lane;
  made.body = term.body;
  made.translation = translation_slot(term.body);
  if (block && motion_->rigid[term.body].articulated < 0) {
    const auto found = std::find(block->bodies.begin(), block->bodies.end(), shared_of_[term.body]);
    made.translation = block->copy_of(static_cast<std::size_t>(found - block->bodies.begin()));
  }
  made.rotation = made.translation + 1;
  return made;
}

void ContactSolver::read_bodies(RowBlock& block) {
  for (std::size_t i = 0; i < block.bodies.size(); ++i) {
    const auto from = displacement_.begin() + translation_slot(shared_[block.bodies[i]].rigid);
    std::copy(from, from + 2, displacement_.begin() + block.copy_of(i));
  }
}

void ContactSolver::merge_bodies(const Indices& blocks) {
  if (shared_.empty()) return;
  for (const std::int32_t b : blocks) {
    const RowBlock& block = blocks_[b];
    for (std::size_t i = 0; i < block.bodies.size(); ++i) {
      SharedBody& shared = shared_[block.bodies[i]];
      for (int part = 0; part < 2; ++part) {
        const Float4 &copy = displacement_[block.copy_of(i) + part],
                     &before = displacement_[translation_slot(shared.rigid) + part];
        for (int k = 0; k < 3; ++k) shared.change[part].x[k] += copy.x[k] - before.x[k];
      }
    }
  }
  for (const std::int32_t b : blocks) {
    for (const int i : blocks_[b].bodies) {
      SharedBody& shared = shared_[i];
      for (int part = 0; part < 2; ++part) {
        Float4& displacement = displacement_[translation_slot(shared.rigid) + part];
        for (int k = 0; k < 3; ++k) {
          displacement.x[k] += shared.change[part].x[k] / static_cast<float>(shared.limit);
          shared.change[part].x[k] = 0;
        }
      }
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
