// On which side of a surface nodes are.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

namespace lazyccd::scenes {

// Nodes first..last of a body that are straight below a face of the cloth and not above any.
int nodes_below(const btSoftBody& body, int first, int last, const btSoftBody& cloth);

}  // namespace lazyccd::scenes
