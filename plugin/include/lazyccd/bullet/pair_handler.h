// The interface through which Bullet's dispatcher hands over pairs of soft bodies.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/export.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Receives the pairs of soft bodies that Bullet's dispatcher finds. Both solvers implement it.
class LAZYCCD_BULLET_API PairHandler {
 public:
  virtual ~PairHandler() = default;
  /// Receives one pair. Does no detection: one detection serves all pairs of a step. Pairs that
  /// LazyCCD does not handle (clusters, bodies that it left out) go to Bullet's own handler at
  /// once.
  virtual void handle_pair(btSoftBody* a, btSoftBody* b) = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
