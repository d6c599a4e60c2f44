// Velocities after the response: from displacements, with the angular momentum that there was.
#pragma once

#include <vector>

#include "motion/motion.h"
#include "response/islands.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Joules: of all soft vertices and dynamic rigid bodies, with Bullet's velocities or with what the
// response makes of them.
double kinetic_energy_before(const Motion& motion);
double kinetic_energy_after(const Motion& motion);

// Velocities as the solved displacements have them.
void set_velocities(Motion& motion);

// A step applies its impulses at the places of its start, not at those of the impacts, and gaps are
// opened without velocity; both change angular momentum a little. What is in contact and free (no
// pinned node, no static or kinematic body) gets the rigid rotation that restores it.
void restore_angular_momentum(const std::vector<Island>& islands, Motion& motion);

// What moves without velocity (a rigid body that Bullet pushes out of another) would give velocity
// to what it meets. Changes of velocity are given up to the part that does not raise the kinetic
// energy of what is in contact. Momenta stay. Where something of infinite mass drives it at speed
// u, that of Bullet's kinematic body where it has one: contacts bring everything no farther from
// going along with it, so that the norm of the velocities (the root of the sum of m v^2) rises by
// no more than twice that of u.
void limit_kinetic_energy(const std::vector<Island>& islands, Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
