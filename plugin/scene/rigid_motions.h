// The rigid part of a step's motion.
#pragma once

#include "motion/motion.h"
#include "scene/obstacles.h"
#include "scene/soft_scene.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Fills the rigid bodies of a motion, and where their vertices start and end as Bullet has them.
void read_rigid_motions(const StepTopology& topology, const Obstacles& obstacles, Motion& motion);

/// Fills Motion::anchored: the nodes that anchors of the deformable world fix to dynamic bodies.
/// The rigid motions must have been read.
void find_anchored_vertices(const SoftScene& scene, Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
