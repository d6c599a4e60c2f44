// Constants of Bullet's mass-spring force. Bullet (3.24) has no functions that return them, so they
// are read off the forces that two springs of a small body exert.
#pragma once

#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btSoftBody.h>

#include <memory>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct SpringConstants {
  btScalar damping;   ///< N s/m
  bool along_spring;  ///< damps only the velocity in the direction of the spring
};

class SpringProbe {
 public:
  SpringProbe();
  /// Constants of a force that is exactly a btDeformableMassSpringForce.
  SpringConstants read(const btDeformableMassSpringForce& force);

 private:
  btSoftBodyWorldInfo info_;
  std::unique_ptr<btSoftBody> body_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
