// The forces of a deformable world, divided by body: copies of Bullet's forces that act on one body
// each, so that several bodies can be visited at once.
#pragma once

#include <BulletSoftBody/btDeformableLagrangianForce.h>
#include <BulletSoftBody/btSoftBody.h>

#include <memory>
#include <vector>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class BodyForces {
 public:
  using Forces = btAlignedObjectArray<btDeformableLagrangianForce*>;

  /// Reads the forces on the active ones of `bodies`. Returns false if a force is of no class of
  /// Bullet's that is known here, or acts on another active body; then call nothing else.
  bool read(const Forces& forces, const btAlignedObjectArray<btSoftBody*>& bodies);

  struct Acting {
    int force = 0;  ///< index in `forces`
    std::unique_ptr<btDeformableLagrangianForce> copy;
  };
  /// What acts on a body, in the order of `forces`.
  const std::vector<Acting>& on(int body) const { return on_[static_cast<std::size_t>(body)]; }

 private:
  std::vector<std::vector<Acting>> on_;                                       // by body
  std::vector<std::unique_ptr<btDeformableLagrangianForce>> without_bodies_;  // copies, by force
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
