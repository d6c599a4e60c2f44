// Bullet's trees over the faces of a body are for its own passes over soft pairs, which LazyCCD
// takes. Bullet builds them in time quadratic in the faces, and never finishes one of a body in
// several components.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <vector>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// While this lives, bodies do not ask for trees that nothing would read, or that would never be
// finished.
class FaceTreesLeftOut {
 public:
  // `request`: the flag that asks for a tree. `bullets_pairs`: Bullet is to handle soft pairs.
  FaceTreesLeftOut(btAlignedObjectArray<btSoftBody*>& bodies, int request, bool bullets_pairs);
  ~FaceTreesLeftOut();
  FaceTreesLeftOut(const FaceTreesLeftOut&) = delete;
  FaceTreesLeftOut& operator=(const FaceTreesLeftOut&) = delete;

 private:
  int request_;
  std::vector<btSoftBody*> bodies_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
