// On which side of a surface nodes are.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

namespace lazyccd::scenes {

// Straight below a face of the cloth and not above any.
bool is_below(const btVector3& point, const btSoftBody& cloth);
// Nodes first..last of a body that are.
int nodes_below(const btSoftBody& body, int first, int last, const btSoftBody& cloth);

}  // namespace lazyccd::scenes
