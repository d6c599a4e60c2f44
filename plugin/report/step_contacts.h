// Makes the list of contacts of a step that applications receive.
#pragma once

#include <vector>

#include "contact/contact_row.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Sets `contacts` to one contact for each pair in `rows`, with the impulse of all its rows, then
/// the contacts in `report_only_contacts`, on which the response did not act. `rows` must be sorted
/// by contact.
void make_step_contacts(const std::vector<const ContactRow*>& rows,
                        const std::vector<Contact>& report_only_contacts, const SoftScene& scene,
                        const StepTopology& topology, const Motion& motion, const Threads& threads,
                        std::vector<StepContact>& contacts);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
