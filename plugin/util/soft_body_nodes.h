// Questions about one soft body.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Index of a node in its body, or -1 if it is not a node of that body.
int index_of(const btSoftBody& body, const btSoftBody::Node* node);
/// Id in the broad phase, which tells new bodies from old ones at the same address; -1 if the body
/// is in no world.
int proxy_id(const btSoftBody& body);
/// True if the positions and velocities of all nodes are finite.
bool is_finite(const btSoftBody& body);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
