#include "motion/rigid_step.h"

#include "motion/rotation.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

bool RigidStep::moves_along(std::int32_t soft_vertex, const Motion& motion) const {
  const Vector3d start = motion.start_of(soft_vertex), end = motion.end_of(soft_vertex);
  return ((*this)(start)-end).norm() <=
         settings::rounds::moves_along_tolerance * (end - start).norm();
}

RigidStep step_of(const RigidMotion& body) {
  if (body.start == body.end) return {};
  RigidStep step;
  step.centre = body.centre();
  step.translation = to_double(body.end.getOrigin()) - step.centre;
  step.rotation = to_double(body.end.getBasis()) * to_double(body.start.getBasis()).transpose();
  return step;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
