#include "contact_problem.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

constexpr double least_speed = 1e-5;  // m/s
constexpr double least_part = 1e-5;
// What meets more slowly, m/s, rests or soon will, and what is left undone there shows as creep.
constexpr double slow = 0.25;
constexpr int more_of_slow = 4;
// Gaps that are not open yet have the next steps for it.
constexpr int fewer_of_opening = 5;

}  // namespace

ContactProblem::ContactProblem(Of of, const std::vector<ContactRow>& rows, const Motion& motion)
    : of_(of), seconds_(motion.seconds), bodies_(motion.rigid), vertex_(1, -1) {
  std::vector<int> node_of(static_cast<std::size_t>(motion.soft_count()), 0);
  rows_.reserve(rows.size());
  impulses_.resize(rows.size());
  for (const ContactRow& row : rows) {
    Row r;
    r.moved.setZero();
    for (int i = 0; i < 4; ++i) {
      const std::int32_t v = row.contact.vertices[i];
      const bool soft = motion.is_soft(v);
      const Vector3d& end = soft && of == Of::opening ? motion.solved[v] : motion.predicted[v];
      r.moved += row.weights[i] * (end - motion.start_of(v));
      r.weight[i] = row.weights[i];
      r.mobility[i] = soft ? row.weights[i] * motion.inverse_mass[v] : 0;
      r.node[i] = 0;
      if (r.mobility[i] == 0) continue;
      if (node_of[v] == 0) {
        node_of[v] = static_cast<int>(vertex_.size());
        vertex_.push_back(v);
      }
      r.node[i] = node_of[v];
    }
    r.normal = row.normal;
    const double gap = of == Of::opening ? row.opened_gap : row.kept_gap;
    r.least = gap - row.start_gap;
    r.friction = of == Of::opening ? 0 : row.friction;
    r.response = row.response;
    r.sliding_response = row.sliding_response;
    r.body = row.rigid;
    if (row.rigid >= 0) {
      const RigidMotion& body = motion.rigid[row.rigid];
      r.body_weight = row.rigid_weight;
      r.arm = row.arm;
      if (of == Of::opening) r.moved += row.rigid_weight * body.shift + body.turn.cross(row.arm);
    }
    rows_.push_back(r);
  }
  first_body_ = static_cast<int>(vertex_.size());
  displacement_.assign(vertex_.size() + 2 * motion.rigid.size(), Vector3d::Zero());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (of == Of::opening) {
      impulses_[i].normal = rows[i].opening;
    } else {
      impulses_[i].normal = rows[i].impulse;
      impulses_[i].tangential = rows[i].tangential;
    }
    push(rows_[i], impulses_[i].normal * rows_[i].normal + impulses_[i].tangential);
  }
}

Vector3d ContactProblem::moved(const Row& row) const {
  Vector3d sum = row.moved;
  for (int i = 0; i < 4; ++i) sum += row.weight[i] * displacement_[row.node[i]];
  if (row.body >= 0) {
    sum += row.body_weight * displacement_[shift_of(row.body)] +
           displacement_[turn_of(row.body)].cross(row.arm);
  }
  return sum;
}

void ContactProblem::push(const Row& row, const Vector3d& impulse) {
  for (int i = 0; i < 4; ++i) displacement_[row.node[i]] += row.mobility[i] * impulse;
  if (row.body >= 0) {
    const RigidMotion& body = bodies_[row.body];
    displacement_[shift_of(row.body)] += row.body_weight * body.inverse_mass.cwiseProduct(impulse);
    displacement_[turn_of(row.body)] += body.inverse_inertia * row.arm.cross(impulse);
  }
}

ContactProblem::Change ContactProblem::sweep() {
  Change change;
  const auto note = [&change](double impulse, double response) {
    change.largest = std::max(change.largest, std::abs(impulse) / response);
    change.energy += impulse * impulse / response;
  };
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    Impulse& total = impulses_[i];
    const Vector3d now = moved(row);
    const double along = row.normal.dot(now);
    const double normal = std::max(0.0, total.normal + (row.least - along) * row.response);
    if (normal == 0 && total.is_zero()) continue;
    const double more = normal - total.normal;
    note(more, row.response);
    total.normal = normal;
    if (row.friction == 0) {
      push(row, more * row.normal);
      continue;
    }
    // Of a rigid body, the impulse along the normal also turns, which the next sweep sees.
    Vector3d tangential = total.tangential - row.sliding_response * (now - along * row.normal);
    const double most = row.friction * normal, size = tangential.norm();
    if (size > most) tangential *= most / size;
    const Vector3d across = tangential - total.tangential;
    note(across.norm(), row.sliding_response);
    total.tangential = tangential;
    push(row, more * row.normal + across);
  }
  return change;
}

void ContactProblem::solve(int sweeps) {
  // Below what anyone calls moving, and a small part of what the contacts stop.
  double approach = 0;
  for (const Row& row : rows_) approach = std::max(approach, row.least - row.normal.dot(row.moved));
  const double tolerance = std::max(least_speed * seconds_, least_part * approach);
  if (of_ == Of::opening) {
    sweeps = std::max(1, sweeps / fewer_of_opening);
  } else if (approach < slow * seconds_) {
    sweeps *= more_of_slow;
  }

  std::vector<Impulse> before, direction(impulses_.size());
  std::vector<Vector3d> displaced, drift(displacement_.size(), Vector3d::Zero());
  double last = 0;
  for (int i = 1;; ++i) {
    before = impulses_;
    displaced = displacement_;
    const Change change = sweep();
    // Ends with a sweep, so that all impulses are within their bounds.
    if (change.largest < tolerance || i >= sweeps) return;
    // Fletcher and Reeves; begun anew where the last step led away.
    const bool further = change.energy <= last;
    const double beta = further ? change.energy / last : 0;
    last = change.energy;
    for (std::size_t k = 0; k < impulses_.size(); ++k) {
      Impulse &along = direction[k], &now = impulses_[k];
      const Impulse carried = {beta * along.normal, beta * along.tangential};
      along.normal = now.normal - before[k].normal + carried.normal;
      along.tangential = now.tangential - before[k].tangential + carried.tangential;
      now.normal += carried.normal;
      now.tangential += carried.tangential;
    }
    for (std::size_t k = 0; k < displacement_.size(); ++k) {
      const Vector3d carried = beta * drift[k];
      drift[k] = displacement_[k] - displaced[k] + carried;
      displacement_[k] += carried;
    }
  }
}

void ContactProblem::write(std::vector<ContactRow>& rows, Motion& motion) const {
  const bool opening = of_ == Of::opening;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    (opening ? rows[i].opening : rows[i].impulse) = impulses_[i].normal;
    if (!opening) rows[i].tangential = impulses_[i].tangential;
  }
  for (std::size_t k = 1; k < vertex_.size(); ++k) {
    const std::int32_t v = vertex_[k];
    if (opening) {
      motion.opening[v] = displacement_[k];
    } else {
      motion.solved[v] = motion.predicted[v] + displacement_[k];
    }
  }
  for (std::size_t b = 0; b < motion.rigid.size(); ++b) {
    RigidMotion& body = motion.rigid[b];
    const int at = static_cast<int>(b);
    (opening ? body.opening_shift : body.shift) = displacement_[shift_of(at)];
    (opening ? body.opening_turn : body.turn) = displacement_[turn_of(at)];
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
