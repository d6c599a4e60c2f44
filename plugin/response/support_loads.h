// What soft bodies exert on rigid bodies that other rigid bodies support (supports.h).
#pragma once

#include <vector>

#include "contact/contact_row.h"
#include "contact/near_contacts.h"
#include "lazyccd/bullet/precision.h"
#include "motion/motion.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Holds bodies at their supports. Not those near nodes that impulses do not move: such nodes push
/// a body wherever they go.
void hold_at_supports(const NearContacts& near, Motion& motion);

/// Lets bodies leave the supports that the impulses of the rows pull them off. Returns these
/// bodies, as sorted indices in Motion::rigid; they must be solved again.
ScratchVector<int> leave_supports(const std::vector<const ContactRow*>& rows, Motion& motion);

/// Sets RigidMotion::load_velocity and load_angular_velocity.
void set_load_velocities(const std::vector<const ContactRow*>& rows, Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
