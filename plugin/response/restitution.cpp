#include "response/restitution.h"

#include <algorithm>
#include <cmath>

#include "motion/articulated_motion.h"
#include "response/contact_constraints.h"
#include "response/velocities.h"
#include "solver/contact_solver.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

namespace {

// By island.
using Fractions = std::vector<double>;

// Adds a fraction of what `bounce` solved to the velocities of each island.
void add(const Fractions& fractions, const Motion& bounce, const RowIslands& islands,
         Motion& motion) {
  for (std::size_t body = 0; body < motion.rigid_of_body().size(); ++body) {
    const std::int32_t island = islands.of_body(static_cast<std::int32_t>(body));
    if (island < 0) continue;
    const double fraction = fractions[island];
    const std::int32_t rigid = motion.rigid_of_body()[body];
    if (rigid >= 0) {
      const RigidSolution& from = bounce.rigid()[rigid];
      RigidSolution& to = motion.solution_of(motion.rigid()[rigid]);
      to.velocity_change += fraction / motion.dt() * from.translation;
      to.angular_velocity_change += fraction / motion.dt() * from.rotation;
      continue;
    }
    for (std::int32_t v = motion.first_vertex()[body]; v < motion.first_vertex()[body + 1]; ++v)
      motion.velocity_change[v] +=
          fraction * motion.rate()[v] * (bounce.solved[v] - motion.predicted[v]);
  }
  for (std::size_t i = 0; i < bounce.articulated.size(); ++i) {
    const ArticulatedMotion& from = bounce.articulated[i];
    const std::int32_t island = islands.of_rigid(from.links.front().rigid);
    if (island < 0) continue;
    const double fraction = fractions[island];
    motion.articulated[i].add_velocity_change(from, fraction, motion.dt());
  }
}

// The fraction of a change at which the energy, which is quadratic in it, has risen by `spare`.
// The arguments before are the energies without the change, with half of it and with all of it.
double fraction_for(double without, double with_half, double with_all, double spare) {
  if (with_all - without <= spare) return 1;
  const double square = 2 * (with_all - 2 * with_half + without);
  const double linear = with_all - without - square;
  const double root = std::sqrt(std::max(0.0, linear * linear + 4 * square * spare));
  // The stable form of (root - linear) / (2 square).
  return linear > 0 ? 2 * spare / (linear + root) : 0.5 * (root - linear) / square;
}

// Adds what `bounce` solved, as far as the energy of an island does not exceed that before the
// contact.
void add_within_energy(const Motion& bounce, const RowIslands& islands, Motion& motion) {
  const ScratchVector<IslandEnergy> without = kinetic_energies(motion, islands);
  const Fractions half(islands.count(), 0.5);
  add(half, bounce, islands, motion);
  const ScratchVector<IslandEnergy> with_half = kinetic_energies(motion, islands);
  add(half, bounce, islands, motion);
  const ScratchVector<IslandEnergy> with_all = kinetic_energies(motion, islands);
  Fractions rest(islands.count());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const double spare = std::max(0.0, without[i].before - without[i].after);
    rest[i] = fraction_for(without[i].after, with_half[i].after, with_all[i].after, spare) - 1;
  }
  add(rest, bounce, islands, motion);
}

}  // namespace

void add_restitution(RowList& rows, double restitution, double threshold, int sweeps,
                     const Threads& threads, Motion& motion) {
  // The impulses of the rows cannot be reused. They also carry loads that press on a contact, and
  // impact zones may have moved things in their place. So the rows are solved once more, for the
  // gaps that bouncing contacts should have.
  Motion bounce = motion;
  bounce.solved.assign(motion.predicted.begin(), motion.predicted.begin() + motion.soft_count());
  // What the links add is in the solved motion, and so in the velocities already.
  bounce.link_displacement.assign(bounce.solved.size(), Vector3d::Zero());
  bounce.links_moved.clear();
  bounce.turn_displacement.clear();
  for (ArticulatedMotion& body : bounce.articulated) body.stop_motors();
  std::vector<ContactRow> bouncing;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows.can_act(i)) continue;
    ContactRow scratch;
    ContactRow& row = bouncing.emplace_back(rows.get(i, scratch));
    double predicted = 0;
    for (int k = 0; k < 4; ++k)
      predicted += row.weights[k] * row.normal.dot(motion.predicted[row.contact.vertices[k]]);
    const double solved = row.normal.dot(gap_vector_at_end(row, motion));
    const double approach = row.start_gap - predicted;
    const bool bounces =
        row.normal_impulse > 0 && approach >= threshold * motion.dt() && !is_of_link(row.contact);
    const double wanted_gap =
        bounces ? row.start_gap + restitution * approach : std::min(row.target_gap, solved);
    row.target_gap = predicted + wanted_gap - solved;
    row.normal_impulse = row.friction = row.sliding_fraction = 0;
    row.tangent_impulse.setZero();
  }
  RowList list(std::move(bouncing));
  ContactSolver solver(ContactSolver::Target::motion, threads);
  RowIslands islands;
  islands.find(list, bounce, threads);
  solver.set_up(list, islands, bounce);
  solver.solve(sweeps);
  solver.write(bounce);
  add_within_energy(bounce, islands, motion);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
