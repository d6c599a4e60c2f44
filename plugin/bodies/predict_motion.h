// Bullet's prediction of motion, for several soft bodies at once and without trees that nothing
// reads.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include "bodies/side_by_side.h"
#include "lazyccd/bullet/precision.h"
#include "lazyccd/threads.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Calls predict(body) for each active body of bodies.begin(). The broad phase gets the new bounds
/// from the calling thread, in the order of the bodies, as from Bullet: it is shared by all of
/// them. Bodies whose constants change are predicted by the calling thread too.
void predict_motions(const SideBySide::Bodies& bodies, const SideBySide& side_by_side,
                     FunctionRef<void(btSoftBody& body)> predict);

/// True if btSoftBody::predictMotion() reaches no other body's nodes.
bool predicts_alone(const btSoftBody& body);

/// btSoftBody::predictMotion() (Bullet 3.24) without the tree of nodes, for a body that has no tree
/// of faces and whose constants do not change. The rest is the same to the bit.
void predict_without_trees(btSoftBody& body, btScalar dt);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
