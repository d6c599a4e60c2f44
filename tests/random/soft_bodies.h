// Random soft bodies of every kind that Bullet has.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <memory>
#include <string>

#include "random/random_source.h"

namespace lazyccd::test {

/// A soft body that is in no world yet.
struct SoftBody {
  std::unique_ptr<btSoftBody> body;
  std::string kind;  ///< "cloth", "rope", "hull", ...
};

/// A random body at the origin, `size` metres wide. It may consist of several components.
SoftBody random_soft_body(btSoftBodyWorldInfo& info, double size, RandomSource& random);

/// A rope along x, centred at the origin, `size` metres long; sometimes with pinned ends.
SoftBody random_rope(btSoftBodyWorldInfo& info, double size, RandomSource& random);

/// An open tube along x that encloses a box of half extents `inner`, in the frame of the box.
SoftBody sleeve(btSoftBodyWorldInfo& info, const btVector3& inner, RandomSource& random);

}  // namespace lazyccd::test
