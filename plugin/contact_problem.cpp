#include "contact_problem.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "rigid_parts.h"

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

constexpr std::int32_t shift_of(std::int32_t body) { return 1 + 2 * body; }
constexpr std::int32_t turn_of(std::int32_t body) { return 2 + 2 * body; }

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
  for (const RigidPart& part : RigidParts(row.contact, row.weights, motion)) {
    const RigidMotion& body = motion.rigid[part.body];
    sum += part.moved(body.shift, body.turn);
  }
  return sum;
}

// In an order in which rows beside each other have no node in common: as they come, most have one,
// and no more than one of them would fit into a batch.
void append_interleaved(const std::vector<std::int32_t>& rows, std::vector<std::int32_t>& order) {
  constexpr std::size_t streams = 8;
  const std::size_t length = (rows.size() + streams - 1) / streams;
  for (std::size_t i = 0; i < length; ++i) {
    for (std::size_t k = i; k < rows.size(); k += length) order.push_back(rows[k]);
  }
}

bool needs(const RowBatch& batch) {
  for (int i = 0; i < RowBatch::rows; ++i)
    if (batch.terms[4 * i] > 0) return true;
  return false;
}

double inverse_mass_of(std::int32_t vertex, const Motion& motion) {
  return motion.is_soft(vertex) ? motion.inverse_mass[vertex] : 0;
}

}  // namespace

void ContactProblem::set_up(Of of, const std::vector<ContactRow>& rows, const Motion& motion) {
  opening_ = of == Of::opening;
  seconds_ = motion.seconds;
  length_ = mass_ = 1;
  approach_ = 0;
  demands_.resize(rows.size());
  partition_.begin(0);
  parts_.clear();
  bodies_.clear();
  double longest_squared = 0, heaviest = 0;
  bool begun = false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const ContactRow& row = rows[i];
    if (!row.gives_way) continue;
    const Vector3d move = move_without(row, opening_, motion);
    const double gap = opening_ ? open * row.opened_gap : row.kept_gap;
    demands_[i] = {move, gap - row.start_gap - row.normal.dot(move)};
    approach_ = std::max(approach_, demands_[i].need);
    longest_squared = std::max(longest_squared, move.squaredNorm());
    heaviest = std::max(heaviest, row.response);
    begun = begun || impulse_of(row) != 0;
  }
  if (!begun && approach_ < least_speed * seconds_) return;
  if (longest_squared > 0) length_ = std::sqrt(longest_squared);
  if (heaviest > 0) mass_ = heaviest;
  for (const RigidMotion& rigid : motion.rigid) {
    RowBody body = {};
    set(body.inverse_mass, mass_ * rigid.inverse_mass);
    for (int k = 0; k < 3; ++k) set(body.inverse_inertia[k], mass_ * rigid.inverse_inertia.col(k));
    bodies_.push_back(body);
  }
  put_in_order(rows);
  make_batches(rows, motion);
  if (!begun) return;
  for (std::size_t i = 0; i < count(); ++i) kernels_->push(swept(), static_cast<int>(i));
}

// Those that impulses act on. What acts comes first, and so shares batches: what did in the last
// step, then what may in this one.
void ContactProblem::put_in_order(const std::vector<ContactRow>& rows) {
  for (Indices& kind : kinds_) kind.clear();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows[i].gives_way) continue;
    const int kind = impulse_of(rows[i]) != 0 ? 0 : demands_[i].need > 0 ? 1 : 2;
    kinds_[kind].push_back(static_cast<std::int32_t>(i));
  }
  order_.clear();
  for (const Indices& kind : kinds_) append_interleaved(kind, order_);
}

void ContactProblem::make_batches(const std::vector<ContactRow>& rows, const Motion& motion) {
  const std::int32_t first_node = shift_of(static_cast<std::int32_t>(bodies_.size()));
  std::int32_t end = first_node;
  node_of_.assign(static_cast<std::size_t>(motion.soft_count()), 0);
  partition_.begin(static_cast<std::size_t>(first_node) + node_of_.size());
  for (const std::int32_t i : order_) {
    std::array<std::int32_t, RowPartition::most_things> things;
    std::int32_t* last = things.data();
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = rows[i].contact.vertices[k];
      if (rows[i].weights[k] * inverse_mass_of(v, motion) == 0) continue;
      if (node_of_[v] == 0) node_of_[v] = end++;
      *last++ = node_of_[v];
    }
    for (const RigidPart& part : RigidParts(rows[i].contact, rows[i].weights, motion))
      *last++ = shift_of(part.body);
    partition_.add(i, things.data(), last);
  }
  now_.assign(static_cast<std::size_t>(end), Float4{});
  partition_.finish();
  const std::vector<RowPartition::Group>& groups = partition_.groups();
  if (batches_.size() < count()) batches_.resize(count());
  end_.assign(groups.size(), first_node);
  for (std::size_t b = 0; b < groups.size(); ++b) {
    RowBatch& batch = batches_[b];
    if (groups[b].back() == RowPartition::none) batch = {};
    batch.first_part = static_cast<std::int32_t>(parts_.size());
    for (int row = 0; row < RowBatch::rows && groups[b][row] != RowPartition::none; ++row) {
      const ContactRow& given = rows[groups[b][row]];
      fill(batch, row, given, demands_[groups[b][row]], motion);
      for (int k = 0; k < 4; ++k) {
        const bool moves = batch.mobility[4 * row + k] != 0;
        const std::int32_t node = moves ? node_of_[given.contact.vertices[k]] : 0;
        batch.node[4 * row + k] = node;
        end_[b] = std::max(end_[b], node + 1);
      }
    }
    batch.last_part = static_cast<std::int32_t>(parts_.size());
  }
}

void ContactProblem::fill(RowBatch& batch, int row, const ContactRow& given, const Demand& demand,
                          const Motion& motion) {
  const int at = 4 * row;
  const double unit = 1 / (mass_ * length_);
  set(batch.normal + at, given.normal);
  set(batch.sliding + at, (demand.move - given.normal.dot(demand.move) * given.normal) / length_);
  set(batch.impulse + at, (opening_ ? 0 : unit) * given.tangential);
  batch.impulse[at + 3] = static_cast<float>(unit * impulse_of(given));
  float* const terms = batch.terms + at;
  terms[0] = static_cast<float>(demand.need / length_);
  terms[1] = static_cast<float>(given.response / mass_);
  terms[2] = opening_ ? 0 : static_cast<float>(given.friction);
  terms[3] = static_cast<float>(given.sliding_response / mass_);
  float* const compliance = batch.compliance + at;
  compliance[0] = compliance[1] = compliance[2] =
      static_cast<float>(mass_ / given.sliding_response);
  compliance[3] = static_cast<float>(mass_ / given.response);
  for (int k = 0; k < 4; ++k) {
    const double inverse_mass = inverse_mass_of(given.contact.vertices[k], motion);
    batch.weight[at + k] = static_cast<float>(given.weights[k]);
    batch.mobility[at + k] = static_cast<float>(given.weights[k] * inverse_mass * mass_);
  }
  for (const RigidPart& part : RigidParts(given.contact, given.weights, motion)) {
    RowPart p = {};
    set(p.arm, part.arm);
    p.weight = static_cast<float>(part.weight);
    p.row = row;
    p.body = part.body;
    p.shift = shift_of(part.body);
    p.turn = turn_of(part.body);
    parts_.push_back(p);
  }
}

bool ContactProblem::acts(std::int32_t batch) const {
  const float* impulse = batches_[batch].impulse;
  return std::any_of(impulse, impulse + 4 * RowBatch::rows, [](float x) { return x != 0; });
}

void ContactProblem::carry_on(float momentum, const Indices& which) {
  const auto carry = [momentum](float* now, float* last, int count) {
    for (int i = 0; i < count; ++i) {
      const float x = now[i];
      now[i] += momentum * (x - last[i]);
      last[i] = x;
    }
  };
  std::int32_t end = 0;
  for (const std::int32_t i : which) {
    carry(batches_[i].impulse, batches_[i].last, 4 * RowBatch::rows);
    end = std::max(end, end_[i]);
  }
  for (std::int32_t k = 0; k < end; ++k) carry(now_[k].x, last_[k].x, 4);
}

void ContactProblem::solve(int sweeps) {
  if (count() == 0) return;
  double least = least_speed * seconds_;  // metres
  if (opening_) {
    sweeps = std::max(1, sweeps / fewer_of_opening);
  } else if (approach_ < slow * seconds_ ||
             kernels_->most_left(swept(), static_cast<int>(count())) * length_ <
                 steady * seconds_) {
    sweeps = std::min(sweeps, std::numeric_limits<int>::max() / more_of_slow) * more_of_slow;
  } else {
    least = std::max(least, least_part * approach_);
  }
  const auto tolerance = static_cast<float>(least / length_);

  for (std::size_t b = 0; b < count(); ++b)
    std::copy_n(batches_[b].impulse, 4 * RowBatch::rows, batches_[b].last);
  last_ = now_;
  Indices all(count()), acting;
  std::iota(all.begin(), all.end(), 0);
  for (const std::int32_t i : all) {
    if (needs(batches_[i]) || acts(i)) acting.push_back(i);
  }
  int apart = least_apart, next_of_all = apart;
  float least_energy = std::numeric_limits<float>::max();
  int run = 0;  // sweeps in one direction
  for (int i = 1;; ++i) {
    const bool of_all = i >= std::min(next_of_all, sweeps);
    const Indices& which = of_all ? all : acting;
    const SweepChange change =
        kernels_->sweep(swept(), which.data(), static_cast<int>(which.size()));
    const bool settled = change.largest < tolerance * tolerance;
    // Ends with a sweep of all, so that all impulses are within their bounds.
    if (of_all && (settled || i >= sweeps)) return;
    run = change.onward < 0 || change.energy > grown * least_energy ? 1 : run + 1;
    least_energy = std::min(least_energy, change.energy);
    carry_on(static_cast<float>(run - 1) / static_cast<float>(run + 2), which);
    if (of_all || i == 1) {
      Indices act;
      for (const std::int32_t k : which) {
        if (acts(k)) act.push_back(k);
      }
      if (of_all) {
        if (std::includes(acting.begin(), acting.end(), act.begin(), act.end())) apart *= 2;
        next_of_all = i + apart;
      }
      acting.swap(act);
    }
    if (settled) next_of_all = i + 1;
  }
}

void ContactProblem::write(std::vector<ContactRow>& rows, Motion& motion) const {
  const auto shift_of = [this](RigidMotion& body) -> Vector3d& {
    return opening_ ? body.opening_shift : body.shift;
  };
  const auto turn_of = [this](RigidMotion& body) -> Vector3d& {
    return opening_ ? body.opening_turn : body.turn;
  };
  for (const ContactRow& row : rows) {
    if (impulse_of(row) == 0) continue;
    for (const std::int32_t v : row.contact.vertices) {
      if (!motion.is_soft(v)) continue;
      if (opening_) {
        motion.opening[v].setZero();
      } else {
        motion.solved[v] = motion.predicted[v];
      }
    }
  }
  for (RigidMotion& body : motion.rigid) {
    shift_of(body).setZero();
    turn_of(body).setZero();
  }
  const double unit = mass_ * length_;
  for (std::size_t b = 0; b < count(); ++b) {
    const RowPartition::Group& group = partition_.groups()[b];
    for (int i = 0; i < RowBatch::rows && group[i] != RowPartition::none; ++i) {
      ContactRow& row = rows[group[i]];
      const float* impulse = batches_[b].impulse + 4 * i;
      (opening_ ? row.opening : row.impulse) = unit * static_cast<double>(impulse[3]);
      if (!opening_)
        row.tangential = unit * Eigen::Map<const Eigen::Vector3f>(impulse).cast<double>();
    }
  }
  for (const ContactRow& row : rows) {
    if (impulse_of(row) == 0) continue;
    Vector3d impulse = impulse_of(row) * row.normal;
    if (!opening_) impulse += row.tangential;
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = row.contact.vertices[k];
      const double mobility = row.weights[k] * inverse_mass_of(v, motion);
      if (mobility != 0) (opening_ ? motion.opening : motion.solved)[v] += mobility * impulse;
    }
    for (const RigidPart& part : RigidParts(row.contact, row.weights, motion)) {
      RigidMotion& body = motion.rigid[part.body];
      part.push(body, impulse, shift_of(body), turn_of(body));
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
