#include "response/contact_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "contact/rigid_terms.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// Sweeps end where they change less: below what anyone calls moving, or of what is far from rest a
// small part of what the contacts stop.
constexpr double least_speed = 3e-5;  // m/s
constexpr double least_part = 3e-3;
// What meets more slowly, m/s, rests or soon will, and what is left undone there shows as creep.
constexpr double slow = 0.25;
// So does a load, however hard it presses, where last step's impulses carry it but for this, m/s.
constexpr double steady = 0.02;
constexpr int more_of_slow = 4;
// Of the width that a gap is to have: what the motion has left undone is not worth opening it.
constexpr double open = 0.999;
// Gaps that are not open yet have the next steps for it.
constexpr int fewer_of_opening = 5;
// Most rows never act: before a sweep of all, as many less one go over those that do; twice as many
// from then on where a sweep of all finds no other that does.
constexpr int least_apart = 8;
// Of the least that a sweep has changed.
constexpr float grown = 4;

constexpr std::int32_t shift_of(std::int32_t body) { return 1 + RowBatch::vertices + 2 * body; }
constexpr std::int32_t turn_of(std::int32_t body) { return shift_of(body) + 1; }

// The first three of four floats.
void set(float* to, const Vector3d& x) {
  for (int k = 0; k < 3; ++k) to[k] = static_cast<float>(x[k]);
}

// How far one side moves against the other in the step without the impulses of the problem.
Vector3d move_without(const ContactRow& row, bool opening, const Motion& motion) {
  Vector3d sum = Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    const std::int32_t v = row.contact.vertices[k];
    const Vector3d& end = opening && motion.is_free(v) ? motion.solved[v] : motion.predicted[v];
    sum += row.weights[k] * (end - motion.start_of(v));
  }
  if (!opening) return sum;
  for (const RigidTerm& part : RigidTerms(row.contact, row.weights, motion)) {
    const RigidMotion& body = motion.rigid[part.body];
    sum += part.moved(body.translation, body.rotation);
  }
  return sum;
}

SpeculativeContact speculative_contact_of(const ContactRow& row, bool opening, const Motion& motion) {
  const Vector3d move = move_without(row, opening, motion);
  SpeculativeContact speculative = speculative_contact_of(row, move);
  if (opening) speculative.need = open * row.corrected_gap - row.start_gap - row.normal.dot(move);
  return speculative;
}

// In an order in which rows beside each other have no node in common: as they come, most have one,
// and no more than one of them would fit into a batch.
template <class Each>
void for_each_interleaved(const std::vector<std::int32_t>& rows, const Each& each) {
  constexpr std::size_t streams = 8;
  const std::size_t length = (rows.size() + streams - 1) / streams;
  for (std::size_t i = 0; i < length; ++i) {
    for (std::size_t k = i; k < rows.size(); k += length) each(rows[k]);
  }
}

double inverse_mass_of(std::int32_t vertex, const Motion& motion) {
  return motion.is_soft(vertex) ? motion.inverse_mass[vertex] : 0;
}

}  // namespace

void ContactSolver::set_up(Of of, RowList& rows, const Motion& motion) {
  rows_ = &rows;
  motion_ = &motion;
  opening_ = of == Of::opening;
  length_ = mass_ = 1;
  demands_.resize(rows.size());
  row_batches_.begin(0);
  parts_.clear();
  bodies_.clear();
  end_.clear();
  vertices_.clear();
  if (opening_ && !find_demands(true)) return;
  if (!find_demands(false)) return;
  if (longest_squared_ > 0) length_ = std::sqrt(longest_squared_);
  if (heaviest_ > 0) mass_ = heaviest_;
  for (const RigidMotion& rigid : motion.rigid) {
    RowBody body = {};
    set(body.inverse_mass, mass_ * rigid.inverse_mass);
    for (int k = 0; k < 3; ++k) set(body.inverse_inertia[k], mass_ * rigid.inverse_inertia.col(k));
    bodies_.push_back(body);
  }
  now_.assign(static_cast<std::size_t>(first_node()), Float4{});
  node_of_.assign(static_cast<std::size_t>(motion.soft_count()) + 1, 0);
  row_batches_.begin(now_.size() + node_of_.size());
  set_up_inactive();
  activate(begun_);
  for (std::size_t i = 0; i < count(); ++i) kernels_->push(swept(), static_cast<int>(i));
  activate_violated();
}

// Of all rows, or of those that may be opened. False where none needs anything.
bool ContactSolver::find_demands(bool only_to_open) {
  approach_ = longest_squared_ = heaviest_ = 0;
  begun_.clear();
  inactive_rows_.resize(demands_.size());
  std::size_t waiting = 0;
  const auto add = [&](std::size_t i, const SpeculativeContact& speculative, bool acts) {
    demands_[i].need = speculative.need;
    approach_ = std::max(approach_, speculative.need);
    longest_squared_ = std::max(longest_squared_, speculative.move_squared);
    heaviest_ = std::max(heaviest_, speculative.normal_mass);
    if (acts) {
      begun_.push_back(static_cast<std::int32_t>(i));
    } else {
      inactive_rows_[waiting++] = static_cast<std::int32_t>(i);
    }
  };
  for (std::size_t i = 0; i < demands_.size(); ++i) {
    bool& may_open = demands_[i].may_open;
    if (!rows_->is_movable(i)) {
      may_open = false;
    } else if (!opening_ && !rows_->is_made(i)) {
      may_open = rows_->speculative(i).may_open;
      add(i, rows_->speculative(i), false);
    } else if (may_open || !only_to_open) {
      const ContactRow& row = (*rows_)[i];
      if (!opening_) may_open = row.corrected_gap > row.target_gap || row.split_impulse != 0;
      add(i, speculative_contact_of(row, opening_, *motion_), impulse_of(row) != 0);
    }
  }
  inactive_rows_.resize(waiting);
  return !begun_.empty() || approach_ >= least_speed * motion_->dt;
}

// Rows without an impulse.
void ContactSolver::set_up_inactive() {
  const std::size_t count = inactive_rows_.size();
  inactive_.resize((count + InactiveBatch::rows - 1) / InactiveBatch::rows);
  if (count > 0) inactive_.back() = InactiveBatch{};  // it may lack some
  const bool has_parts = !motion_->rigid.empty() || !motion_->anchored.empty();
  for (std::size_t n = 0; n < count; ++n) {
    InactiveBatch& batch = inactive_[n / InactiveBatch::rows];
    const int row = static_cast<int>(n % InactiveBatch::rows), at = 4 * row;
    if (row == 0) batch.first_part = static_cast<std::int32_t>(parts_.size());
    const auto i = static_cast<std::size_t>(inactive_rows_[n]);
    const Contact& contact = rows_->contact(i);
    const std::array<double, 4> weights = contact.weights();
    std::copy(contact.normal.begin(), contact.normal.end(), batch.normal + at);
    batch.normal[at + 3] = static_cast<float>(demands_[i].need / length_);
    for (int k = 0; k < 4; ++k) {
      batch.weight[at + k] = static_cast<float>(weights[k]);
      batch.vertex[at + k] = std::min(contact.vertices[k], motion_->soft_count());
    }
    if (has_parts) add_parts(contact, weights, row);
    batch.last_part = static_cast<std::int32_t>(parts_.size());
  }
}

void ContactSolver::find_violated() {
  violated_.resize(InactiveBatch::rows * inactive_.size());
  violated_.resize(static_cast<std::size_t>(
      kernels_->lacking(swept(), node_of_.data(), inactive_.data(),
                        static_cast<int>(inactive_.size()), violated_.data())));
}

bool ContactSolver::activate_violated() {
  find_violated();
  for (std::int32_t& i : violated_) {
    // Whoever is in the problem waits no more.
    inactive_[i / InactiveBatch::rows].normal[4 * (i % InactiveBatch::rows) + 3] =
        std::numeric_limits<float>::lowest();
    i = inactive_rows_[i];
  }
  activate(violated_);
  return !violated_.empty();
}

void ContactSolver::activate(const Indices& admitted) {
  RowList& rows = *rows_;
  const Motion& motion = *motion_;
  std::size_t b = count();
  for_each_interleaved(admitted, [&](std::int32_t i) {
    demands_[i].may_open = true;
    const ContactRow& row = rows[i];
    std::array<std::int32_t, RowBatches::most_things> things;
    std::int32_t* last = things.data();
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = row.contact.vertices[k];
      if (row.weights[k] * inverse_mass_of(v, motion) == 0) continue;
      if (node_of_[v] == 0) {
        node_of_[v] = first_node() + static_cast<std::int32_t>(vertices_.size());
        vertices_.push_back(v);
      }
      *last++ = node_of_[v];
    }
    for (const RigidTerm& part : RigidTerms(row.contact, row.weights, motion))
      *last++ = shift_of(part.body);
    row_batches_.add(i, things.data(), last);
  });
  row_batches_.finish();
  now_.resize(static_cast<std::size_t>(first_node()) + vertices_.size());
  if (batches_.size() < count()) batches_.resize(count());
  for (; b < count(); ++b) {
    const RowBatches::Group& group = row_batches_.groups()[b];
    RowBatch& batch = batches_[b];
    if (group.back() == RowBatches::none) {
      batch = {};
      std::iota(std::begin(batch.pushed), std::end(batch.pushed), 1);
    }
    std::int32_t end = first_node();
    batch.first_part = static_cast<std::int32_t>(parts_.size());
    for (int row = 0; row < RowBatch::rows && group[row] != RowBatches::none; ++row) {
      fill(batch, row, rows[group[row]], demands_[group[row]]);
      for (int k = 0; k < 4; ++k) end = std::max(end, batch.node[4 * row + k] + 1);
    }
    batch.last_part = static_cast<std::int32_t>(parts_.size());
    std::copy(std::begin(batch.impulse), std::end(batch.impulse), batch.last);
    end_.push_back(end);
  }
}

void ContactSolver::fill(RowBatch& batch, int row, const ContactRow& given, const Demand& demand) {
  const int at = 4 * row;
  const double unit = 1 / (mass_ * length_);
  const Vector3d move = move_without(given, opening_, *motion_);
  set(batch.normal + at, given.normal);
  set(batch.sliding + at, (move - given.normal.dot(move) * given.normal) / length_);
  set(batch.impulse + at, (opening_ ? 0 : unit) * given.tangent_impulse);
  batch.impulse[at + 3] = static_cast<float>(unit * impulse_of(given));
  float* const terms = batch.terms + at;
  terms[0] = static_cast<float>(demand.need / length_);
  terms[1] = static_cast<float>(given.normal_mass / mass_);
  terms[2] = opening_ ? 0 : static_cast<float>(given.friction);
  terms[3] = static_cast<float>(given.tangent_mass / mass_);
  float* const compliance = batch.compliance + at;
  compliance[0] = compliance[1] = compliance[2] =
      static_cast<float>(mass_ / given.tangent_mass);
  compliance[3] = static_cast<float>(mass_ / given.normal_mass);
  for (int k = 0; k < 4; ++k) {
    const std::int32_t v = given.contact.vertices[k];
    batch.weight[at + k] = static_cast<float>(given.weights[k]);
    batch.mobility[at + k] =
        static_cast<float>(given.weights[k] * inverse_mass_of(v, *motion_) * mass_);
    const bool moves = batch.mobility[at + k] != 0;
    batch.node[at + k] = moves ? node_of_[v] : 0;
    batch.pushed[at + k] = moves ? node_of_[v] : 1 + at + k;
  }
  add_parts(given.contact, given.weights, row);
}

void ContactSolver::add_parts(const Contact& contact, const std::array<double, 4>& weights,
                               int row) {
  for (const RigidTerm& part : RigidTerms(contact, weights, *motion_)) {
    RowRigidTerm p = {};
    set(p.arm, part.arm);
    p.weight = static_cast<float>(part.weight);
    p.row = row;
    p.body = part.body;
    p.translation = shift_of(part.body);
    p.rotation = turn_of(part.body);
    parts_.push_back(p);
  }
}

bool ContactSolver::is_batch_active(std::int32_t batch) const {
  const float* impulse = batches_[batch].impulse;
  return std::any_of(impulse, impulse + 4 * RowBatch::rows, [](float x) { return x != 0; });
}

void ContactSolver::extrapolate(float momentum, const Indices& which) {
  std::int32_t end = 0;
  for (const std::int32_t b : which) {
    RowBatch& batch = batches_[b];
    for (int i = 0; i < 4 * RowBatch::rows; ++i) {
      const float x = batch.impulse[i];
      batch.impulse[i] += momentum * (x - batch.last[i]);
      batch.last[i] = x;
    }
    end = std::max(end, end_[b]);
  }
  last_.resize(now_.size());
  kernels_->extrapolate(momentum, now_.data(), last_.data(), end);
}

void ContactSolver::solve(int sweeps) {
  if (count() == 0) return;
  const double dt = motion_->dt;
  double least = least_speed * dt;  // metres
  if (opening_) {
    sweeps = std::max(1, sweeps / fewer_of_opening);
  } else if (approach_ < slow * dt ||
             kernels_->most_left(swept(), static_cast<int>(count())) * length_ < steady * dt) {
    sweeps = std::min(sweeps, std::numeric_limits<int>::max() / more_of_slow) * more_of_slow;
  } else {
    least = std::max(least, least_part * approach_);
  }
  const auto tolerance = static_cast<float>(least / length_);

  last_ = now_;
  Indices all, acting;
  const auto take_new = [&] {
    for (auto i = static_cast<std::int32_t>(all.size()); i < static_cast<std::int32_t>(count());
         ++i) {
      all.push_back(i);
      acting.push_back(i);
    }
  };
  take_new();
  int apart = least_apart, next_of_all = apart;
  float least_energy = std::numeric_limits<float>::max();
  int run = 0;  // sweeps in one direction
  for (int i = 1;; ++i) {
    const bool of_all = i >= std::min(next_of_all, sweeps);
    if (of_all && activate_violated()) take_new();
    const Indices& which = of_all ? all : acting;
    const SweepChange change =
        kernels_->sweep(swept(), which.data(), static_cast<int>(which.size()));
    const bool settled = change.largest < tolerance * tolerance;
    // Ends with a sweep of all, so that all impulses are within their bounds.
    if (of_all && (settled || i >= sweeps)) break;
    run = change.restart_test < 0 || change.energy > grown * least_energy ? 1 : run + 1;
    least_energy = std::min(least_energy, change.energy);
    extrapolate(static_cast<float>(run - 1) / static_cast<float>(run + 2), which);
    if (of_all || i == 1) {
      Indices act;
      for (const std::int32_t k : which) {
        if (is_batch_active(k)) act.push_back(k);
      }
      if (of_all) {
        if (std::includes(acting.begin(), acting.end(), act.begin(), act.end())) apart *= 2;
        next_of_all = i + apart;
      }
      acting.swap(act);
    }
    if (settled) next_of_all = i + 1;
  }
  find_violated();
  for (const std::int32_t i : violated_) demands_[inactive_rows_[i]].may_open = true;
}

void ContactSolver::write(Motion& motion) {
  RowList& rows = *rows_;
  const auto shift_of = [this](RigidMotion& body) -> Vector3d& {
    return opening_ ? body.split_translation : body.translation;
  };
  const auto turn_of = [this](RigidMotion& body) -> Vector3d& {
    return opening_ ? body.split_rotation : body.rotation;
  };
  for (const std::int32_t v : vertices_) {
    if (opening_) {
      motion.split_displacement[v].setZero();
    } else {
      motion.solved[v] = motion.predicted[v];
    }
  }
  for (RigidMotion& body : motion.rigid) {
    shift_of(body).setZero();
    turn_of(body).setZero();
  }
  const double unit = mass_ * length_;
  for (std::size_t b = 0; b < count(); ++b) {
    const RowBatches::Group& group = row_batches_.groups()[b];
    for (int i = 0; i < RowBatch::rows && group[i] != RowBatches::none; ++i) {
      ContactRow& row = rows[group[i]];
      const float* found = batches_[b].impulse + 4 * i;
      (opening_ ? row.split_impulse : row.normal_impulse) = unit * static_cast<double>(found[3]);
      if (!opening_)
        row.tangent_impulse = unit * Eigen::Map<const Eigen::Vector3f>(found).cast<double>();
      if (impulse_of(row) == 0) continue;
      Vector3d impulse = impulse_of(row) * row.normal;
      if (!opening_) impulse += row.tangent_impulse;
      for (int k = 0; k < 4; ++k) {
        const std::int32_t v = row.contact.vertices[k];
        const double mobility = row.weights[k] * inverse_mass_of(v, motion);
        if (mobility != 0) (opening_ ? motion.split_displacement : motion.solved)[v] += mobility * impulse;
      }
      for (const RigidTerm& part : RigidTerms(row.contact, row.weights, motion)) {
        RigidMotion& body = motion.rigid[part.body];
        part.push(body, impulse, shift_of(body), turn_of(body));
      }
    }
  }
  for (const std::int32_t v : vertices_) motion.round_end(v);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
