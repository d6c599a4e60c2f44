// Where Bullet's dispatcher leaves the pairs of soft bodies that it meets.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class PairHandler {
 public:
  virtual ~PairHandler() = default;
  // Does no work on the pair yet: all pairs of a step are detected together. Pairs that are not
  // LazyCCD's (clusters, bodies that it had to leave out) go to Bullet's own handler at once.
  virtual void handle_pair(btSoftBody* a, btSoftBody* b) = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
