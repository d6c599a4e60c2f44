// Makes the list of contacts of a step that applications receive.
#pragma once

#include <vector>

#include "contact/contact_row.h"
#include "lazyccd/bullet/report.h"
#include "motion/motion.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Returns one contact for each pair in `rows`, with the impulse of all its rows, then the contacts
/// in `report_only_contacts`, on which the response did not act. `rows` must be sorted by contact.
std::vector<StepContact> step_contacts(const std::vector<const ContactRow*>& rows,
                                       const std::vector<Contact>& report_only_contacts,
                                       const SoftScene& scene, const StepTopology& topology,
                                       const Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
