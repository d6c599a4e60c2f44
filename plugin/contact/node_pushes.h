// How far contacts move the nodes of soft bodies, compared with their edges.
#pragma once

#include <vector>

#include "contact/contact_row.h"
#include "motion/motion.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// By body: displacement in the step by the impulses of contacts, as a multiple of
/// Motion::median_edge.
struct NodePushes {
  /// Of the node that one contact moves the farthest.
  ScratchVector<double> largest;
  /// Of contacts with weights: mean over their impulses of how far all contacts together move the
  /// contact point. A weight is a dynamic rigid body or link that is much heavier than the nodes,
  /// and that nothing rigid supports. Nodes between it and something else are hardly moved.
  ScratchVector<double> by_weights;
  /// Whether weights press, that is, approach the body by themselves and by gravity. A body that a
  /// joint holds, and on which the soft body lies, does not. Nor do jaws that grip it, or links.
  ScratchVector<char> weights_press;
};

/// `rows`: the contacts with impulses.
NodePushes find_node_pushes(const std::vector<const ContactRow*>& rows, const Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
