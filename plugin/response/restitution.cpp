#include "response/restitution.h"

#include <algorithm>
#include <cmath>

#include "response/contact_constraints.h"
#include "response/contact_solver.h"
#include "response/velocities.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void add_restitution(RowList& rows, double restitution, double threshold, int sweeps,
                     Motion& motion) {
  // The rows' impulses say nothing about it: they also carry what presses on a contact, and zones
  // may have moved it in their place. So the rows are solved once more, for the gaps that what
  // bounces is to have.
  Motion next = motion;
  next.solved.assign(motion.predicted.begin(), motion.predicted.begin() + motion.soft_count());
  std::vector<ContactRow> bouncing;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows.is_movable(i)) continue;
    rows.copy(i, bouncing);
    ContactRow& row = bouncing.back();
    double predicted = 0;
    for (int k = 0; k < 4; ++k)
      predicted += row.weights[k] * row.normal.dot(motion.predicted[row.contact.vertices[k]]);
    const double solved = row.normal.dot(separation(row, motion));
    const double approach = row.start_gap - predicted;
    const bool bounces = row.normal_impulse > 0 && approach >= threshold * motion.dt;
    const double wanted =
        bounces ? row.start_gap + restitution * approach : std::min(row.target_gap, solved);
    row.target_gap = predicted + wanted - solved;
    row.normal_impulse = row.friction = 0;
    row.tangent_impulse.setZero();
  }
  RowList list(std::move(bouncing));
  ContactSolver problem;
  problem.set_up(ContactSolver::Of::motion, list, next);
  problem.solve(sweeps);
  problem.write(next);
  const auto add = [&](double part) {
    for (std::size_t v = 0; v < next.solved.size(); ++v)
      motion.velocity_change[v] += part * motion.rate[v] * (next.solved[v] - motion.predicted[v]);
    for (std::size_t b = 0; b < next.rigid.size(); ++b) {
      motion.rigid[b].velocity_change += part / motion.dt * next.rigid[b].translation;
      motion.rigid[b].angular_velocity_change += part / motion.dt * next.rigid[b].rotation;
    }
  };
  // The energy is quadratic in the part: up to where it is what it was before the contact.
  const double without = kinetic_energy_after(motion);
  add(0.5);
  const double with_half = kinetic_energy_after(motion);
  add(0.5);
  const double with_all = kinetic_energy_after(motion);
  const double spare = std::max(0.0, kinetic_energy_before(motion) - without);
  if (with_all - without <= spare) return;
  const double square = 2 * (with_all - 2 * with_half + without);
  const double linear = with_all - without - square;
  const double root = std::sqrt(std::max(0.0, linear * linear + 4 * square * spare));
  // The stable form of (root - linear) / (2 square).
  const double part = linear > 0 ? 2 * spare / (linear + root) : 0.5 * (root - linear) / square;
  add(part - 1);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
