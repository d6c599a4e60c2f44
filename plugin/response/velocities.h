// Velocities after the response: from displacements, with restitution, and with the angular
// momentum that there was.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/contact_row.h"
#include "motion/motion.h"
#include "contact/row_list.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Joules: of all soft vertices and dynamic rigid bodies, with Bullet's velocities or with what the
// response makes of them.
double kinetic_energy_before(const Motion& motion);
double kinetic_energy_after(const Motion& motion);

// Velocities as the solved displacements have them.
void set_velocities(Motion& motion);

// Newton's restitution, in velocities alone: what met at `threshold` m/s or faster and was stopped
// flies apart with `restitution` times that speed in the next step, and by that nothing comes
// closer to anything else than it may. Given up to the part that keeps the kinetic energy below
// what it was.
void add_restitution(RowList& rows, double restitution, double threshold, int sweeps,
                     Motion& motion);

// Bodies that are in contact with each other, directly or through others, with what their momentum
// is made of.
struct Island {
  std::vector<std::int32_t> bodies;
  bool free = true;  // nothing of infinite mass
  double drive = 0;  // m/s: the fastest point of what has infinite mass and was not stopped
};
std::vector<Island> find_islands(const std::vector<const ContactRow*>& rows, const Motion& motion);

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

// Soft bodies in loaded contact lose the velocity of their deformation at `rate` 1/s, the faster
// the further its root mean square is below `rest_speed` m/s. What moves as a rigid body goes on,
// so both momenta are kept, and what slides, falls or swings as a whole is not slowed. Mueller et
// al. 2007, "Position based dynamics", section 3.5. Without it cloth in contact trembles for long:
// the load wanders between neighbouring contacts, and Bullet's links answer it.
void damp_deformation(const std::vector<const ContactRow*>& rows, double rate, double rest_speed,
                      Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
