// The problem of the contact solver: which rows take part, and their layout in blocks.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "contact/rigid_terms.h"
#include "lazyccd/debug/assert.h"
#include "motion/articulated_motion.h"
#include "settings.h"
#include "solver/contact_solver.h"
#include "solver/contact_solver_parts.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

RowCoupling make_coupling(const Mobility& mobility) {
  RowCoupling coupling = {};
  for (int k = 0; k < 6; ++k) {
    set(coupling.translation_by[k], mobility.col(k).head<3>());
    set(coupling.rotation_by[k], mobility.col(k).tail<3>());
  }
  return coupling;
}

}  // namespace

Vector3d move_without_impulses(const ContactRow& row, bool for_split_impulse,
                               const Motion& motion) {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    const std::int32_t v = row.contact.vertices[k];
    Vector3d end = motion.end_without_impulses(v);
    if (motion.is_free(v)) end = for_split_impulse ? motion.solved[v] : motion.predicted[v];
    sum += row.weights[k] * (end - motion.start_of(v));
  }
  if (!for_split_impulse) return sum;
  for (const RigidTerm& term : RigidTerms(row.contact, row.weights, motion)) {
    const RigidMotion& body = motion.rigid()[term.body];
    sum += term.displacement(body.translation, body.rotation);
  }
  return sum;
}

RowEstimate ContactSolver::estimate(const ContactRow& row) const {
  const Vector3d move = move_without_impulses(row, for_split_impulse_, *motion_);
  RowEstimate estimate = estimate_row(row, move);
  if (!for_split_impulse_) return estimate;
  const bool is_pressed =
      std::binary_search(pressed_.begin(), pressed_.end(), ordered_bodies(row.contact));
  double gap = row.corrected_gap;
  if (is_pressed) gap = std::max(row.target_gap, std::min(gap, row.loaded_gap));
  // A little less than what impulses keep: a narrower gap, or a longer link, whose gap is negative.
  constexpr double less = settings::solver::split_gap_fraction;
  if (is_pressed || !(gap > row.target_gap)) gap *= is_of_link(row.contact) ? 2 - less : less;
  estimate.need = gap - row.start_gap - row.normal.dot(move);
  return estimate;
}

bool ContactSolver::is_current(const Contact& contact) const {
  return motion_->turn_displacement.empty() ||
         std::all_of(contact.vertices.begin(), contact.vertices.end(),
                     [this](std::int32_t v) { return motion_->turn_displacement[v].isZero(); });
}

void ContactSolver::Largest::include(const Largest& other) {
  need = std::max(need, other.need);
  move_squared = std::max(move_squared, other.move_squared);
  normal_mass = std::max(normal_mass, other.normal_mass);
}

void ContactSolver::RowsByIsland::clear() {
  rows.clear();
  parts.clear();
}

void ContactSolver::RowsByIsland::add(std::size_t island, std::int32_t row) {
  if (parts.empty() || parts.back().island != island)
    parts.push_back({island, rows.size(), rows.size()});
  rows.push_back(row);
  parts.back().last = rows.size();
}

void ContactSolver::set_up(RowList& rows, const RowIslands& islands, const Motion& motion,
                           Manner manner, Span<const BodyPair> pressed) {
  LAZYCCD_ASSERT(islands.row_count() <= rows.size(), "islands are of the rows to solve");
  LAZYCCD_ASSERT(motion.solved.size() == motion.inverse_mass().size() &&
                     motion.predicted.size() == motion.size(),
                 "the response to the motion has begun");
  rows_ = &rows;
  islands_ = &islands;
  motion_ = &motion;
  manner_ = manner;
  pressed_ = pressed;
  has_rigid_terms_ = !motion.rigid().empty() || !motion.anchored().empty();
  needs_.resize(rows.size());
  block_count_ = block_row_count_ = stage_count_ = 0;
  bodies_.clear();
  couplings_.clear();
  displacement_.clear();
  make_chunks();
  if (for_split_impulse_ && !classify_rows(true)) return;
  if (!classify_rows(false)) return;
  for (Problem& problem : problems_) {
    const Largest& largest = problem.largest;
    if (largest.move_squared > 0) problem.length_unit = std::sqrt(largest.move_squared);
    if (largest.normal_mass > 0) problem.mass_unit = largest.normal_mass;
  }
  set_up_bodies();
  displacement_.resize(1 + 2 * bodies_.size());
  vertex_of_.assign(displacement_.size(), -1);
  node_of_.assign(static_cast<std::size_t>(motion.soft_count()) + 1, 0);
  restart_displacements();
  if (scratch_.empty()) scratch_.resize(static_cast<std::size_t>(threads_.count()));
  for_each(chunk_count_, [this](std::size_t i, int) { set_up_inactive(chunks_[i]); });
  new_rows_.clear();
  for (std::size_t i = 0; i < chunk_count_; ++i) {
    for (const std::int32_t row : chunks_[i].active) new_rows_.add(chunks_[i].island, row);
  }
  add_blocks();
  apply_impulses();
  add_violated();
}

bool ContactSolver::are_set_up() const {
  for (std::size_t island = 0; island < problems_.size(); ++island)
    if (islands_->is_selected(island) && !problems_[island].is_set_up) return false;
  return islands_ != nullptr;
}

void ContactSolver::go_on() {
  LAZYCCD_ASSERT(are_set_up(), "a problem that goes on was set up");
  if (displacement_.empty()) return;  // nothing was open
  for_each(block_count_, [this](std::size_t i, int) { restart(blocks_[i]); });
  add_violated();
}

void ContactSolver::restart_displacements() {
  std::fill(displacement_.begin(),
            displacement_.begin() + static_cast<std::ptrdiff_t>(1 + 2 * motion_->rigid().size()),
            Float4{});
  set_motor_displacements();
  for_each(block_count_, [this](std::size_t i, int) {
    const RowBlock& block = blocks_[i];
    std::int32_t slot = block.first_new_slot;
    for (const std::int32_t v : block.new_vertices)
      displacement_[slot++] = link_displacement(v, problems_[block.island]);
  });
}

// Rows that have no impulse find there how far such nodes have moved.
void ContactSolver::give_slots_to_moved(std::int32_t body) {
  const std::int32_t island = islands_->of_body(body);
  if (island < 0 || !islands_->is_selected(static_cast<std::size_t>(island))) return;
  const double length_unit = problems_[island].length_unit;
  for (std::int32_t v = motion_->first_vertex()[body]; v < motion_->first_vertex()[body + 1]; ++v) {
    std::int32_t& slot = node_of_[v];
    const Vector3d& moved = motion_->link_displacement[v];
    if (moved.isZero() || (slot > 0 && !is_unclaimed(slot))) continue;
    if (slot == 0) {
      slot = displacement_count();
      displacement_.emplace_back();
      vertex_of_.push_back(-1);
    }
    set(displacement_[slot].x, moved / length_unit);
  }
}

Float4 ContactSolver::link_displacement(std::int32_t vertex, const Problem& problem) const {
  Float4 displacement = {};
  if (!for_split_impulse_ && !motion_->links_moved.empty())
    set(displacement.x, motion_->link_displacement[vertex] / problem.length_unit);
  return displacement;
}

// Bodies are where they were. Nodes are where links have moved them from.
void ContactSolver::restart(RowBlock& block) {
  if (!is_selected(block)) return;
  const double length_unit = problems_[block.island].length_unit;
  std::int32_t slot = block.first_new_slot;
  for (const std::int32_t v : block.new_vertices)
    set(displacement_[slot++].x, (motion_->solved[v] - motion_->predicted[v]) / length_unit);
  block.active.resize(block.batches.size());
  std::iota(block.active.begin(), block.active.end(), 0);
  for (RowBatch& batch : block.batches) {
    std::copy(std::begin(batch.impulse), std::end(batch.impulse), batch.last_impulse);
    if (batch.slides) bound_sliding(batch);
  }
}

void ContactSolver::add_blocks() {
  NewBlocks added(*this);
  const std::size_t count = added.start();
  threads_for(count).run_phases(
      count, [&](std::size_t item, int worker) { added.run(item, worker); },
      [&] { return added.next(); });
}

void ContactSolver::apply_impulses() {
  for_each_block_by_stage(
      [this](RowBlock& block, int) {
        if (!is_selected(block)) return;
        read_shared(block);
        for (std::size_t i = 0; i < block.batches.size(); ++i)
          kernels_->apply_impulses(problem_of(block), static_cast<int>(i));
      },
      [this](const SharedSlots& shared, const SharedSlots::Grain& grain) {
        if (islands_->is_selected(grain.island)) join(shared, grain);
      });
}

void ContactSolver::add_violated() {
  for (std::size_t body = 0; !for_split_impulse_ && body < motion_->links_moved.size(); ++body)
    if (motion_->links_moved[body]) give_slots_to_moved(static_cast<std::int32_t>(body));
  for_each(chunk_count_, [this](std::size_t i, int) {
    RowChunk& chunk = chunks_[i];
    chunk.violated.clear();
    if (islands_->is_selected(chunk.island)) find_violated(chunk);
  });
  take_violated();
  add_blocks();
  if (manner_ != Manner::round && !for_split_impulse_) find_max_violations();
}

void ContactSolver::find_max_violations() {
  for_each(block_count_, [this](std::size_t i, int) {
    RowBlock& block = blocks_[i];
    if (!is_selected(block)) return;
    read_shared(block);
    block.violation =
        kernels_->max_violation(problem_of(block), static_cast<int>(block.batches.size()));
  });
  for (Problem& problem : problems_) problem.max_violation = 0;
  for (std::size_t i = 0; i < block_count_; ++i) {
    if (!is_selected(blocks_[i])) continue;
    Problem& problem = problems_[blocks_[i].island];
    problem.max_violation = std::max(
        problem.max_violation, static_cast<double>(blocks_[i].violation) * problem.length_unit);
  }
}

void ContactSolver::set_up_bodies() {
  for (std::size_t i = 0; i < motion_->rigid().size(); ++i) {
    const RigidMotion& rigid = motion_->rigid()[i];
    const Problem* const problem = problem_of_rigid(i);
    const double mass_unit = problem ? problem->mass_unit : 1;
    RowBody body = {};
    set(body.inverse_mass, mass_unit * rigid.inverse_mass);
    for (int k = 0; k < 3; ++k)
      set(body.inverse_inertia[k], mass_unit * rigid.inverse_inertia.col(k));
    if (rigid.supported_mobility) {
      body.held = static_cast<std::int32_t>(couplings_.size());
      couplings_.push_back(make_coupling(mass_unit * *rigid.supported_mobility));
    }
    bodies_.push_back(body);
  }
  row_body_of_.resize(bodies_.size());
  for (const ArticulatedMotion& multibody : motion_->articulated) {
    const Problem* const problem = problem_of_rigid(multibody.links.front().rigid);
    const double mass_unit = problem ? problem->mass_unit : 1;
    for (const ArticulatedMotion::Link& pushed : multibody.links) {
      RowBody& body = bodies_[static_cast<std::size_t>(pushed.rigid)];
      body.first_coupling = static_cast<std::int32_t>(couplings_.size());
      for (const ArticulatedMotion::Link& moved : multibody.links) {
        const Mobility mobility = mass_unit * multibody.mobility(pushed, moved);
        RowCoupling coupling = make_coupling(mobility);
        coupling.translation = translation_slot(moved.rigid);
        coupling.rotation = coupling.translation + 1;
        couplings_.push_back(coupling);
      }
      body.last_coupling = static_cast<std::int32_t>(couplings_.size());
    }
  }
}

void ContactSolver::set_motor_displacements() {
  if (for_split_impulse_) return;
  for (const ArticulatedMotion& multibody : motion_->articulated) {
    const Problem* const problem = problem_of_rigid(multibody.links.front().rigid);
    if (!problem || !multibody.has_motor_impulse()) continue;
    const std::vector<Vector6d> displacements = multibody.motor_displacements();
    for (std::size_t i = 0; i < displacements.size(); ++i) {
      const Vector6d moved = displacements[i] / problem->length_unit;
      const std::int32_t slot = translation_slot(multibody.links[i].rigid);
      set(displacement_[slot].x, moved.head<3>());
      set(displacement_[slot + 1].x, moved.tail<3>());
    }
  }
}

void ContactSolver::find_pushed_islands() {
  if (for_split_impulse_) return;
  for (const ArticulatedMotion& multibody : motion_->articulated) {
    const std::int32_t island = islands_->of_rigid(multibody.links.front().rigid);
    if (island >= 0 && multibody.has_motor_impulse()) problems_[island].is_pushed = true;
  }
  for (std::size_t body = 0; body < motion_->links_moved.size(); ++body) {
    const std::int32_t island = islands_->of_body(static_cast<std::int32_t>(body));
    if (island >= 0 && motion_->links_moved[body]) problems_[island].is_pushed = true;
  }
}

void ContactSolver::make_chunks() {
  problems_.assign(islands_->count(), {});
  find_pushed_islands();
  chunk_count_ = 0;
  for (std::size_t island = 0; island < problems_.size(); ++island) {
    if (!islands_->is_selected(island)) continue;
    problems_[island].is_set_up = problems_[island].is_open = true;
    const Span<const std::int32_t> rows = islands_->rows_of(island);
    for (std::size_t first = 0; first < rows.size(); first += RowChunk::max_rows) {
      if (chunks_.size() == chunk_count_) chunks_.emplace_back();
      RowChunk& chunk = chunks_[chunk_count_++];
      chunk.island = island;
      chunk.rows = {rows.data() + first, std::min(RowChunk::max_rows, rows.size() - first)};
    }
  }
}

bool ContactSolver::classify_rows(bool only_may_need_split) {
  for_each(chunk_count_, [&](std::size_t i, int) {
    RowChunk& chunk = chunks_[i];
    if (problems_[chunk.island].is_open) classify(chunk, only_may_need_split);
  });
  for (Problem& problem : problems_) {
    problem.largest = {};
    problem.any_active = false;
  }
  for (std::size_t i = 0; i < chunk_count_; ++i) {
    Problem& problem = problems_[chunks_[i].island];
    problem.largest.include(chunks_[i].largest);
    problem.any_active = problem.any_active || !chunks_[i].active.empty();
  }
  bool any_open = false;
  for (Problem& problem : problems_) {
    problem.is_open =
        problem.is_open && (problem.any_active || problem.is_pushed ||
                            problem.largest.need >= settings::solver::min_speed * motion_->dt());
    any_open = any_open || problem.is_open;
  }
  for (std::size_t i = 0; i < chunk_count_; ++i) {
    if (problems_[chunks_[i].island].is_open) continue;
    chunks_[i].active.clear();
    chunks_[i].inactive.clear();
  }
  return any_open;
}

void ContactSolver::classify(RowChunk& chunk, bool only_may_need_split) {
  chunk.largest = {};
  chunk.active.clear();
  chunk.inactive.clear();
  const auto add = [&](std::size_t i, const RowEstimate& estimate, bool is_active) {
    needs_[i] = estimate.need;
    chunk.largest.include({estimate.need, estimate.move_squared, estimate.normal_mass});
    (is_active ? chunk.active : chunk.inactive).push_back(static_cast<std::int32_t>(i));
  };
  for (const std::int32_t row_index : chunk.rows) {
    const auto i = static_cast<std::size_t>(row_index);
    if (!for_split_impulse_ && !rows_->is_made(i) && is_current(rows_->contact(i))) {
      rows_->set_may_need_split(i, rows_->estimate(i).may_need_split);
      add(i, rows_->estimate(i), false);
    } else if (rows_->may_need_split(i) || !only_may_need_split) {
      ContactRow scratch;
      const ContactRow& row = rows_->get(i, scratch);
      if (!for_split_impulse_)
        rows_->set_may_need_split(i, row.corrected_gap > row.target_gap || row.split_impulse != 0);
      add(i, estimate(row), has_impulse(row));
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
    batch.normal[at + 3] = static_cast<float>(needs_[i] / problems_[chunk.island].length_unit);
    for (int k = 0; k < 4; ++k) {
      batch.weight[at + k] = static_cast<float>(weights[k]);
      batch.vertex[at + k] = std::min(contact.vertices[k], motion_->soft_count());
    }
    if (has_rigid_terms_) {
      for (const RigidTerm& term : RigidTerms(contact, weights, *motion_))
        chunk.terms.push_back(make_term(term, lane));
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

void ContactSolver::take_violated() {
  new_rows_.clear();
  for (std::size_t c = 0; c < chunk_count_; ++c) {
    RowChunk& chunk = chunks_[c];
    for (const std::int32_t i : chunk.violated) {
      // A row that is in the problem is never found again.
      chunk.batches[i / InactiveBatch::lanes].normal[4 * (i % InactiveBatch::lanes) + 3] =
          std::numeric_limits<float>::lowest();
      new_rows_.add(chunk.island, chunk.inactive[i]);
    }
  }
}

void ContactSolver::read_shared(const RowBlock& block) {
  for (std::size_t i = 0; i < block.shared.size(); ++i)
    displacement_[block.copy(i)] = displacement_[block.shared[i]];
}

void ContactSolver::join(const SharedSlots& shared, const SharedSlots::Grain& grain) {
  for (std::size_t i = grain.first; i < grain.last; ++i) {
    Float4& joined = displacement_[shared.slot(i)];
    const Span<const std::int32_t> copies = shared.copies(i);
    Float4 change = {};
    for (const std::int32_t copy : copies)
      for (int k = 0; k < 3; ++k) change.x[k] += displacement_[copy].x[k] - joined.x[k];
    for (int k = 0; k < 3; ++k) joined.x[k] += change.x[k] / static_cast<float>(copies.size());
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
