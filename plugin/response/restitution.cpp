#include "response/restitution.h"

#include <algorithm>
#include <cmath>

#include "response/contact_constraints.h"
#include "response/velocities.h"
#include "solver/contact_solver.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void add_restitution(RowList& rows, double restitution, double threshold, int sweeps,
                     const Threads& threads, Motion& motion) {
  // The impulses of the rows cannot be reused. They also carry loads that press on a contact, and
  // impact zones may have moved things in their place. So the rows are solved once more, for the
  // gaps that bouncing contacts should have.
  Motion bounce = motion;
  bounce.solved.assign(motion.predicted.begin(), motion.predicted.begin() + motion.soft_count());
  // What the links add is in the solved motion, and so in the velocities already.
  bounce.link_displacement.assign(bounce.solved.size(), Eigen::Vector3d::Zero());
  bounce.turn_displacement.clear();
  std::vector<ContactRow> bouncing;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows.can_act(i)) continue;
    rows.copy(i, bouncing);
    ContactRow& row = bouncing.back();
    double predicted = 0;
    for (int k = 0; k < 4; ++k)
      predicted += row.weights[k] * row.normal.dot(motion.predicted[row.contact.vertices[k]]);
    const double solved = row.normal.dot(gap_vector_at_end(row, motion));
    const double approach = row.start_gap - predicted;
    const bool bounces = row.normal_impulse > 0 && approach >= threshold * motion.dt;
    const double wanted_gap =
        bounces ? row.start_gap + restitution * approach : std::min(row.target_gap, solved);
    row.target_gap = predicted + wanted_gap - solved;
    row.normal_impulse = row.friction = row.sliding_fraction = 0;
    row.tangent_impulse.setZero();
  }
  RowList list(std::move(bouncing));
  ContactSolver solver(threads);
  RowIslands islands;
  islands.find(list, bounce, threads);
  solver.set_up(ContactSolver::Target::motion, list, islands, bounce);
  solver.solve(sweeps);
  solver.write(bounce);
  const auto add = [&](double fraction) {
    for (std::size_t v = 0; v < bounce.solved.size(); ++v)
      motion.velocity_change[v] +=
          fraction * motion.rate[v] * (bounce.solved[v] - motion.predicted[v]);
    for (std::size_t b = 0; b < bounce.rigid.size(); ++b) {
      motion.rigid[b].velocity_change += fraction / motion.dt * bounce.rigid[b].translation;
      motion.rigid[b].angular_velocity_change += fraction / motion.dt * bounce.rigid[b].rotation;
    }
    for (std::size_t b = 0; b < bounce.articulated.size(); ++b) {
      const ArticulatedMotion& body = bounce.articulated[b];
      motion.articulated[b].velocity_change += fraction / motion.dt * body.displacement;
      motion.articulated[b].momentum_change += fraction / motion.dt * body.impulse;
    }
  };
  // The energy is quadratic in the fraction of the change. Finds the fraction at which it equals
  // that before the contact.
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
  const double fraction = linear > 0 ? 2 * spare / (linear + root) : 0.5 * (root - linear) / square;
  add(fraction - 1);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
