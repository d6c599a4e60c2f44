// Soft bodies of every kind that Bullet knows, at random.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <memory>
#include <string>

#include "random/random_source.h"

namespace lazyccd::test {

struct SoftBody {
  std::unique_ptr<btSoftBody> body;
  std::string kind;
};

// About the origin, `size` metres wide, in one or more parts.
SoftBody random_soft_body(btSoftBodyWorldInfo& info, double size, RandomSource& random);

SoftBody random_rope(btSoftBodyWorldInfo& info, double size, RandomSource& random);

// An open tube along x about a box of these half sides, in its frame.
SoftBody sleeve(btSoftBodyWorldInfo& info, const btVector3& inner, RandomSource& random);

}  // namespace lazyccd::test
