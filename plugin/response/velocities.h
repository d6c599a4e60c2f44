// Velocities after the response. They follow from displacements; angular momentum is restored and
// kinetic energy limited.
#pragma once

#include <vector>

#include "lazyccd/span.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"
#include "response/islands.h"
#include "solver/row_islands.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Kinetic energy of all soft vertices and dynamic rigid bodies, joules: with Bullet's velocities
/// (before), and with the changes of the response (after). Of multibodies only the change counts.
double kinetic_energy_before(const Motion& motion);
double kinetic_energy_after(const Motion& motion);

/// The same of the bodies of one island.
struct IslandEnergy {
  double before = 0, after = 0;
};
/// By island of the rows.
ScratchVector<IslandEnergy> kinetic_energies(const Motion& motion, const RowIslands& islands);

/// Selects the islands of the rows whose kinetic energy the response raises, and no others. Returns
/// whether there are any.
bool select_with_energy_gain(const Motion& motion, RowIslands& islands);

/// Sets the velocity changes that follow from the solved displacements.
void set_velocities(const Threads& threads, Motion& motion);

/// Restores the angular momentum of every free island (no pinned node, no static or kinematic body,
/// no locked axes) by adding a rigid rotation to its velocity changes. Two things change angular
/// momentum a little: a step applies its impulses at the positions of its start instead of
/// those of the impacts, and split impulses move things without velocity. Bodies that only anchors
/// connect to the island are not turned: nothing but the pull of the anchor acts on them.
void restore_angular_momentum(Span<const Island> islands, const Threads& threads, Motion& motion);

/// Limits the speeds of soft vertices in islands that are not free. A body that pushes an edge near
/// one end may have to move the other end many times as fast as itself (a lever). The displacement
/// stays. The vertex keeps at most twice the speed of the fastest body in the island, as after an
/// elastic impact. A mass of the island that was faster before the response raises the limit.
void limit_lever_speeds(Span<const Island> islands, const Threads& threads, Motion& motion);

/// Scales the velocity changes of every island so that they do not raise its kinetic energy.
/// Without this limit, a rigid body that Bullet pushes out of another one by position would give
/// velocity to the cloth it meets. Scaling keeps linear and angular momentum.
///
/// An island with something of infinite mass that moves at velocity u may gain energy. |u| is
/// Island::prescribed_speed. A contact never increases the difference between the velocity of a
/// mass and u. Therefore the norm of the velocities, sqrt(sum m v^2), rises by at most twice the
/// norm for speed u, and this much is allowed.
void limit_kinetic_energy(Span<const Island> islands, const Threads& threads, Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
