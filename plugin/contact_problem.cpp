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

Eigen::Vector4f padded(const Vector3d& x) {
  const Eigen::Vector3f f = x.cast<float>();
  return {f.x(), f.y(), f.z(), 0};
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

// Those that impulses act on. As they come, each shares nodes with the one before and would wait
// for it, so they take turns.
std::vector<std::size_t> interleaved(const std::vector<ContactRow>& rows) {
  constexpr std::size_t streams = 8;
  const std::size_t length = (rows.size() + streams - 1) / streams;
  std::vector<std::size_t> order;
  order.reserve(rows.size());
  for (std::size_t i = 0; i < length; ++i) {
    for (std::size_t k = i; k < rows.size(); k += length) {
      if (rows[k].gives_way) order.push_back(k);
    }
  }
  return order;
}

// How much further apart along the normal the impulses are to bring it, at least.
double need(const ContactRow& row, bool opening, const Vector3d& move) {
  return (opening ? open * row.opened_gap : row.kept_gap) - row.start_gap - row.normal.dot(move);
}

double inverse_mass_of(std::int32_t vertex, const Motion& motion) {
  return motion.is_soft(vertex) ? motion.inverse_mass[vertex] : 0;
}

}  // namespace

ContactProblem::ContactProblem(Of of, const std::vector<ContactRow>& rows, const Motion& motion)
    : opening_(of == Of::opening), seconds_(motion.seconds), order_(interleaved(rows)) {
  std::vector<Vector3d> moves;
  moves.reserve(rows.size());
  double longest = 0, heaviest = 0;
  bool begun = false;
  for (const ContactRow& row : rows) {
    moves.push_back(move_without(row, opening_, motion));
    if (!row.gives_way) continue;
    approach_ = std::max(approach_, need(row, opening_, moves.back()));
    longest = std::max(longest, moves.back().norm());
    heaviest = std::max(heaviest, row.response);
    begun = begun || (opening_ ? row.opening : row.impulse) != 0;
  }
  impulses_.resize(order_.size());
  if (!begun && approach_ < least_speed * seconds_) return;
  if (longest > 0) length_ = longest;
  if (heaviest > 0) mass_ = heaviest;

  std::vector<std::int32_t> node_of(static_cast<std::size_t>(motion.soft_count()), 0);
  std::int32_t nodes = 1;
  rows_.reserve(rows.size());
  for (const std::size_t i : order_) {
    rows_.push_back(make_row(rows[i], moves[i], motion));
    for (int k = 0; k < 4; ++k) {
      const std::int32_t v = rows[i].contact.vertices[k];
      if (rows_.back().mobility[k] == 0 || !motion.is_soft(v)) continue;
      std::int32_t& node = node_of[v];
      if (node == 0) node = nodes++;
      rows_.back().node[k] = node;
    }
  }
  first_body_ = nodes;
  bodies_.reserve(motion.rigid.size());
  for (const RigidMotion& rigid : motion.rigid) {
    bodies_.push_back({padded(mass_ * rigid.inverse_mass), Eigen::Matrix4f::Zero()});
    bodies_.back().inverse_inertia.topLeftCorner<3, 3>() =
        (mass_ * rigid.inverse_inertia).cast<float>();
  }
  displacement_.assign(static_cast<std::size_t>(nodes) + 2 * bodies_.size(), Vector::Zero());
  const double unit = 1 / (mass_ * length_);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const ContactRow& row = rows[order_[i]];
    if (!opening_) impulses_[i].across = padded(unit * row.tangential);
    impulses_[i].along = static_cast<float>(unit * (opening_ ? row.opening : row.impulse));
    push(rows_[i], impulses_[i]);
  }
}

ContactProblem::Row ContactProblem::make_row(const ContactRow& row, const Vector3d& move,
                                             const Motion& motion) {
  Row r;
  r.normal = padded(row.normal);
  r.sliding = padded((move - row.normal.dot(move) * row.normal) / length_);
  r.need = static_cast<float>(need(row, opening_, move) / length_);
  r.friction = opening_ ? 0 : static_cast<float>(row.friction);
  r.response = static_cast<float>(row.response / mass_);
  r.compliance = static_cast<float>(mass_ / row.response);
  r.sliding_response = static_cast<float>(row.sliding_response / mass_);
  r.sliding_compliance = static_cast<float>(mass_ / row.sliding_response);
  r.first_part = static_cast<std::int32_t>(parts_.size());
  for (const RigidPart& part : RigidParts(row.contact, row.weights, motion)) {
    parts_.push_back({padded(part.arm), static_cast<float>(part.weight), part.body});
  }
  r.last_part = static_cast<std::int32_t>(parts_.size());
  for (int k = 0; k < 4; ++k) {
    const double inverse_mass = inverse_mass_of(row.contact.vertices[k], motion);
    r.weight[k] = static_cast<float>(row.weights[k]);
    r.mobility[k] = static_cast<float>(row.weights[k] * inverse_mass * mass_);
  }
  return r;
}

inline void ContactProblem::push(const Row& row, const Impulse& impulse) {
  const Vector total = impulse.along * row.normal + impulse.across;
  for (int k = 0; k < 4; ++k) displacement_[row.node[k]] += row.mobility[k] * total;
  for (std::int32_t i = row.first_part; i < row.last_part; ++i) {
    const Part& part = parts_[i];
    const Body& body = bodies_[part.body];
    displacement_[shift_of(part.body)] += part.weight * body.inverse_mass.cwiseProduct(total);
    displacement_[turn_of(part.body)] += body.inverse_inertia * part.arm.cross3(total);
  }
}

inline ContactProblem::Vector ContactProblem::moved(const Row& row) const {
  const auto share = [&](int k) { return row.weight[k] * displacement_[row.node[k]]; };
  Vector sum = (share(0) + share(1)) + (share(2) + share(3));
  for (std::int32_t i = row.first_part; i < row.last_part; ++i) {
    const Part& part = parts_[i];
    sum += part.weight * displacement_[shift_of(part.body)] +
           displacement_[turn_of(part.body)].cross3(part.arm);
  }
  return sum;
}

ContactProblem::Change ContactProblem::sweep(const Indices& which) {
  Change change;
  const auto note = [&change](float impulse_squared, float compliance) {
    const float energy = impulse_squared * compliance;
    change.largest = std::max(change.largest, energy * compliance);
    change.energy += energy;
  };
  for (const std::int32_t i : which) {
    const Row& row = rows_[i];
    const Impulse before = impulses_[i];
    const Vector moved = this->moved(row);
    const float along = row.normal.dot(moved);
    Impulse now;
    now.along = std::max(0.0f, before.along + (row.need - along) * row.response);
    if (now.along == 0 && before.is_zero()) continue;
    if (row.friction > 0) {
      // Of a rigid body, the impulse along the normal also turns, which the next sweep sees.
      const Vector sliding = row.sliding + moved - along * row.normal;
      now.across = before.across - row.sliding_response * sliding;
      const float most = row.friction * now.along, squared = now.across.squaredNorm();
      if (squared > most * most) now.across *= most / std::sqrt(squared);
    }
    const Impulse more = {now.across - before.across, now.along - before.along};
    note(more.along * more.along, row.compliance);
    note(more.across.squaredNorm(), row.sliding_compliance);
    const Impulse& last = last_[i];
    change.onward += row.compliance * more.along * (now.along - last.along) +
                     row.sliding_compliance * more.across.dot(now.across - last.across);
    impulses_[i] = now;
    push(row, more);
  }
  return change;
}

double ContactProblem::most_left() const {
  float most = 0;
  for (const Row& row : rows_) most = std::max(most, row.need - row.normal.dot(moved(row)));
  return static_cast<double>(most);
}

void ContactProblem::carry_on(float momentum, const Indices& which) {
  for (const std::int32_t i : which) {
    const Impulse now = impulses_[i];
    impulses_[i].across += momentum * (now.across - last_[i].across);
    impulses_[i].along += momentum * (now.along - last_[i].along);
    last_[i] = now;
  }
  for (std::size_t k = 0; k < displacement_.size(); ++k) {
    const Vector now = displacement_[k];
    displacement_[k] += momentum * (now - last_displacement_[k]);
    last_displacement_[k] = now;
  }
}

void ContactProblem::solve(int sweeps) {
  if (rows_.empty()) return;
  double least = least_speed * seconds_;  // metres
  if (opening_) {
    sweeps = std::max(1, sweeps / fewer_of_opening);
  } else if (approach_ < slow * seconds_ || most_left() * length_ < steady * seconds_) {
    sweeps = std::min(sweeps, std::numeric_limits<int>::max() / more_of_slow) * more_of_slow;
  } else {
    least = std::max(least, least_part * approach_);
  }
  const auto tolerance = static_cast<float>(least / length_);

  last_ = impulses_;
  last_displacement_ = displacement_;
  Indices all(rows_.size()), acting;
  std::iota(all.begin(), all.end(), 0);
  for (const std::int32_t k : all) {
    if (rows_[k].need > 0 || !impulses_[k].is_zero()) acting.push_back(k);
  }
  int apart = least_apart, next_of_all = apart;
  float least_energy = std::numeric_limits<float>::max();
  int run = 0;  // sweeps in one direction
  for (int i = 1;; ++i) {
    const bool of_all = i >= std::min(next_of_all, sweeps);
    const Indices& which = of_all ? all : acting;
    const Change change = sweep(which);
    const bool settled = change.largest < tolerance * tolerance;
    // Ends with a sweep of all, so that all impulses are within their bounds.
    if (of_all && (settled || i >= sweeps)) return;
    run = change.onward < 0 || change.energy > grown * least_energy ? 1 : run + 1;
    least_energy = std::min(least_energy, change.energy);
    carry_on(static_cast<float>(run - 1) / static_cast<float>(run + 2), which);
    if (of_all || i == 1) {
      Indices act;
      for (const std::int32_t k : which) {
        if (!impulses_[k].is_zero()) act.push_back(k);
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
  for (std::size_t i = 0; i < order_.size(); ++i) {
    ContactRow& row = rows[order_[i]];
    const double normal = unit * static_cast<double>(impulses_[i].along);
    const Vector3d tangential = unit * impulses_[i].across.head<3>().cast<double>();
    (opening_ ? row.opening : row.impulse) = normal;
    if (!opening_) row.tangential = tangential;
    if (impulses_[i].is_zero()) continue;
    const Vector3d impulse = normal * row.normal + tangential;
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
