// The parts of btDeformableBodySolver's step (Bullet 3.24, explicit scheme) that go over all nodes,
// several bodies at once. The results are Bullet's to the bit.
#pragma once

#include <BulletSoftBody/btDeformableBackwardEulerObjective.h>
#include <BulletSoftBody/btSoftBody.h>

#include <vector>

#include "bodies/body_forces.h"
#include "bodies/conjugate_residual.h"
#include "bodies/side_by_side.h"
#include "lazyccd/bullet/precision.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The bodies of a solver. Node i of a body is element first_node[body] + i of a VectorStack.
struct DeformableBodies {
  const SideBySide::Bodies& bodies;
  const SideBySide& side_by_side;
  ScratchVector<int> first_node;

  DeformableBodies(const SideBySide::Bodies& all, const SideBySide& visitor);
};

/// True if the following functions, and Bullet's prediction, reach no other body's nodes.
bool moves_alone(const btSoftBody& body);

/// btDeformableBackwardEulerObjective::applyExplicitForce(). `force` is zero before and after.
void apply_explicit_forces(const DeformableBodies& all, const BodyForces& forces, btScalar dt,
                           VectorStack& force);

/// btDeformableBodySolver::setupDeformableSolve(): the velocity changes by contacts go into `dv`.
void read_velocity_changes(const DeformableBodies& all, const VectorStack& backup, VectorStack& dv);

/// btDeformableBodySolver::updateVelocity().
void update_velocities(const DeformableBodies& all, const VectorStack& backup, VectorStack& dv);

/// Sets btSoftBody::m_maxSpeedSquared of the active bodies, as btDeformableBodySolver does.
void find_largest_speeds(const DeformableBodies& all);

/// btDeformableBodySolver::applyTransforms(), for bodies without anchors to links of multibodies.
void apply_transforms(const DeformableBodies& all, btScalar dt);
/// True if a body has an anchor to a link.
bool is_anchored_to_link(const btSoftBody& body);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
