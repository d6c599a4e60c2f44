#include "response/contact_solver.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/rigid_terms.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// The sweeps end when the change of a sweep is below any visible speed (ContactSolver::min_speed)
// or, far from rest, below this fraction of the approach that the contacts stop.
constexpr double min_fraction = 3e-3;
// Contacts that approach more slowly, m/s, are at rest or soon will be. An error left there shows
// as creep, so they get more sweeps.
constexpr double slow_approach = 0.25;
// Contacts also count as resting if, with last step's impulses, no row is violated by more than
// this speed, m/s, whatever the load.
constexpr double resting_speed = 0.02;
// Factor of the number of sweeps for both.
constexpr int slow_sweep_factor = 4;
// Divisor of the number of sweeps for split impulses. Gaps that are still too narrow are restored
// in the next steps.
constexpr int split_sweep_divisor = 5;
// Sweeps from one full sweep to the next. Most rows never act, so the sweeps in between visit only
// batches that carry an impulse. The interval doubles if a full sweep activated no new batch.
constexpr int first_full_sweep_interval = 8;
// Sweeps in which the impulse of sliding friction is a fraction of what would hold, as long as the
// contact carries a load. After them its size is a constant bound, like that of Tresca's friction:
// it has no other bound that goes to zero with the load, so contacts whose load comes and goes with
// their friction would never settle.
constexpr int sliding_sweeps = 8;
// Restart the extrapolation if a sweep's change exceeds this multiple of the smallest change so
// far.
constexpr float max_change_growth = 4;

}  // namespace

bool ContactSolver::is_batch_active(std::int32_t batch) const {
  const float* impulse = batches_[batch].impulse;
  return std::any_of(impulse, impulse + 4 * RowBatch::lanes, [](float x) { return x != 0; });
}

void ContactSolver::set_sliding(const Indices& swept, bool is_final) {
  for (const std::int32_t b : swept) {
    RowBatch& batch = batches_[b];
    for (int i = 0; i < RowBatch::lanes; ++i) {
      const float* const impulse = batch.impulse + 4 * i;
      float& bound = batch.tangent_move[4 * i + 3];
      if (is_final && bound > 0) {
        const float size =
            std::sqrt(impulse[0] * impulse[0] + impulse[1] * impulse[1] + impulse[2] * impulse[2]);
        bound = -std::max(size, std::numeric_limits<float>::min());
      } else if (bound >= 0) {
        bound = impulse[3] > 0 ? batch.sliding_fraction[i] : 0;
      }
    }
  }
}

void ContactSolver::extrapolate(float factor, const Indices& swept) {
  std::int32_t end = 0;
  for (const std::int32_t b : swept) {
    RowBatch& batch = batches_[b];
    for (int i = 0; i < 4 * RowBatch::lanes; ++i) {
      const float x = batch.impulse[i];
      batch.impulse[i] += factor * (x - batch.last_impulse[i]);
      batch.last_impulse[i] = x;
    }
    end = std::max(end, batch_end_[b]);
  }
  last_displacement_.resize(displacement_.size());
  kernels_->extrapolate(factor, displacement_.data(), last_displacement_.data(), end);
}

void ContactSolver::solve(int sweeps) {
  if (batch_count() == 0) return;
  const double dt = motion_->dt;
  double min_change = min_speed * dt;  // metres
  if (for_split_impulse_) {
    sweeps = std::max(1, sweeps / split_sweep_divisor);
  } else if (max_need_ < slow_approach * dt || max_violation_ < resting_speed * dt) {
    sweeps =
        std::min(sweeps, std::numeric_limits<int>::max() / slow_sweep_factor) * slow_sweep_factor;
  } else {
    min_change = std::max(min_change, min_fraction * max_need_);
  }
  const auto tolerance = static_cast<float>(min_change / length_unit_);

  last_displacement_ = displacement_;
  Indices all, active;
  const auto add_new_batches = [&] {
    for (auto i = static_cast<std::int32_t>(all.size());
         i < static_cast<std::int32_t>(batch_count()); ++i) {
      all.push_back(i);
      active.push_back(i);
    }
  };
  add_new_batches();
  int full_interval = first_full_sweep_interval, next_full = full_interval;
  float min_change_size = std::numeric_limits<float>::max();
  int run_length = 0;  // sweeps since the extrapolation was restarted
  for (int i = 1;; ++i) {
    const bool is_full = i >= std::min(next_full, sweeps);
    if (is_full && activate_violated()) add_new_batches();
    const Indices& swept = is_full ? all : active;
    const SweepChange change =
        kernels_->sweep(problem(), swept.data(), static_cast<int>(swept.size()));
    const bool settled = change.largest < tolerance * tolerance;
    // The last sweep is a full one, so that all impulses are within their bounds.
    if (is_full && (settled || i >= sweeps)) break;
    run_length = change.restart_test < 0 || change.size > max_change_growth * min_change_size
                     ? 1
                     : run_length + 1;
    min_change_size = std::min(min_change_size, change.size);
    set_sliding(swept, i >= sliding_sweeps);
    extrapolate(static_cast<float>(run_length - 1) / static_cast<float>(run_length + 2), swept);
    if (is_full || i == 1) {
      Indices now_active;
      for (const std::int32_t k : swept) {
        if (is_batch_active(k)) now_active.push_back(k);
      }
      if (is_full) {
        if (std::includes(active.begin(), active.end(), now_active.begin(), now_active.end()))
          full_interval *= 2;
        next_full = i + full_interval;
      }
      active.swap(now_active);
    }
    if (settled) next_full = i + 1;
  }
  find_violated();
  for (const std::int32_t i : violated_) needs_[inactive_rows_[i]].may_need_split = true;
}

void ContactSolver::write(Motion& motion) {
  RowList& rows = *rows_;
  const auto translation_of = [this](RigidMotion& body) -> Vector3d& {
    return for_split_impulse_ ? body.split_translation : body.translation;
  };
  const auto rotation_of = [this](RigidMotion& body) -> Vector3d& {
    return for_split_impulse_ ? body.split_rotation : body.rotation;
  };
  for (const std::int32_t v : vertex_of_node_) {
    if (for_split_impulse_) {
      motion.split_displacement[v].setZero();
    } else {
      motion.solved[v] = motion.predicted[v] + motion.link_displacement[v];
    }
  }
  for (RigidMotion& body : motion.rigid) {
    translation_of(body).setZero();
    rotation_of(body).setZero();
  }
  for (ArticulatedMotion& body : motion.articulated)
    (for_split_impulse_ ? body.split_impulse : body.impulse).setZero();
  const double unit = mass_unit_ * length_unit_;
  for (std::size_t b = 0; b < batch_count(); ++b) {
    const RowBatches::Batch& batch_rows = row_batches_.batches()[b];
    for (int i = 0; i < RowBatch::lanes && batch_rows[i] != RowBatches::none; ++i) {
      ContactRow& row = rows[batch_rows[i]];
      const float* solved = batches_[b].impulse + 4 * i;
      (for_split_impulse_ ? row.split_impulse : row.normal_impulse) =
          unit * static_cast<double>(solved[3]);
      if (!for_split_impulse_)
        row.tangent_impulse = unit * Eigen::Map<const Eigen::Vector3f>(solved).cast<double>();
      if (!has_impulse(row)) continue;
      const Vector3d impulse = for_split_impulse_ ? row.split_impulse * row.normal : row.impulse();
      for (int k = 0; k < 4; ++k) {
        const std::int32_t v = row.contact.vertices[k];
        const double mobility = row.weights[k] * motion.inverse_mass_of(v);
        if (mobility != 0)
          (for_split_impulse_ ? motion.split_displacement : motion.solved)[v] += mobility * impulse;
      }
      for (const RigidTerm& term : RigidTerms(row.contact, row.weights, motion)) {
        RigidMotion& body = motion.rigid[term.body];
        if (body.articulated < 0) {
          term.apply_impulse(body, impulse, translation_of(body), rotation_of(body));
          continue;
        }
        ArticulatedMotion& multibody = motion.articulated[body.articulated];
        Eigen::Matrix<double, 6, 1> on_link;
        on_link << term.weight * impulse, term.arm.cross(impulse);
        (for_split_impulse_ ? multibody.split_impulse : multibody.impulse) +=
            multibody.link_of(term.body).jacobian.transpose() * on_link;
      }
    }
  }
  for (const std::int32_t v : vertex_of_node_) motion.round_end(v);
  for (ArticulatedMotion& body : motion.articulated) {
    const Eigen::VectorXd& by = for_split_impulse_ ? body.split_impulse : body.impulse;
    Eigen::VectorXd& displacement =
        for_split_impulse_ ? body.split_displacement : body.displacement;
    displacement = body.inverse_mass * by;
    for (const ArticulatedMotion::Link& link : body.links) {
      const Eigen::Matrix<double, 6, 1> moved = link.jacobian * displacement;
      translation_of(motion.rigid[link.rigid]) = moved.head<3>();
      rotation_of(motion.rigid[link.rigid]) = moved.tail<3>();
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
