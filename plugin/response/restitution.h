// Restitution: bodies that meet fast enough bounce.
#pragma once

#include "contact/row_list.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Adds Newton's restitution, in velocities alone. Contacts that approached at `threshold` m/s or
/// faster and were stopped separate with `restitution` times that speed in the next step. The solve
/// keeps all other gaps. The change is scaled down if the kinetic energy would exceed that before
/// the contact. `sweeps`: as in ContactSolver::solve().
void add_restitution(RowList& rows, double restitution, double threshold, int sweeps,
                     const Threads& threads, Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
