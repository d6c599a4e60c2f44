// Tells on which side of a cloth nodes are.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

namespace lazyccd::scenes {

/// Returns true if the point is straight below a face of the cloth and not straight above another.
bool is_below(const btVector3& point, const btSoftBody& cloth);
/// Returns how many of the nodes first..last of a body are below the cloth.
int nodes_below(const btSoftBody& body, int first, int last, const btSoftBody& cloth);

}  // namespace lazyccd::scenes
