#include "bodies/spring_constants.h"

#include <cmath>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

SpringProbe::SpringProbe() {
  const btVector3 places[] = {btVector3(0, 0, 0), btVector3(1, 0, 0)};
  const btScalar masses[] = {1, 1};
  body_ = std::make_unique<btSoftBody>(&info_, 2, places, masses);
  body_->appendLink(0, 1);
  for (int i = 0; i < 2; ++i) body_->m_nodes[i].index = i;
  // The second component shows a damping across the spring; if the damping is zero, by the sign of
  // the zero.
  body_->m_nodes[1].m_v = btVector3(1, -1, 0);
}

SpringConstants SpringProbe::read(const btDeformableMassSpringForce& force) {
  btDeformableMassSpringForce probed(force);
  probed.m_softBodies.resize(0);
  probed.addSoftBody(body_.get());
  btDeformableMassSpringForce::TVStack forces;
  forces.resize(2, btVector3(btScalar(-0.), btScalar(-0.), btScalar(-0.)));
  probed.addScaledDampingForce(1, forces);
  return {forces[0].x(), !std::signbit(forces[0].y())};
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
