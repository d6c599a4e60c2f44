// What a step's contacts say to the application.
#pragma once

#include <vector>

#include "contact/contact_row.h"
#include "lazyccd/bullet/report.h"
#include "motion/motion.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// One for each pair of `rows`, with the impulse of all of them, then those of `silent`,
// which nothing was done about. `rows` are sorted by contact.
std::vector<StepContact> step_contacts(const std::vector<const ContactRow*>& rows,
                                       const std::vector<Contact>& unanswered, const SoftScene& scene,
                                       const StepTopology& topology, const Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
