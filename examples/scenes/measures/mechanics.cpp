#include "scenes/measures/mechanics.h"

#include <algorithm>
#include <cmath>

namespace lazyccd::scenes {

Mechanics measure(const PhysicsWorld& world) {
  Mechanics m;
  int count = 0;
  double squares = 0;
  for (const auto& body : world.bodies()) {
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      const btSoftBody::Node& node = body->m_nodes[i];
      if (node.m_im == 0) continue;
      const double mass = 1 / static_cast<double>(node.m_im);
      std::array<double, 3> x, v;
      double square = 0;
      for (int k = 0; k < 3; ++k) {
        x[k] = static_cast<double>(node.m_x[k]);
        v[k] = static_cast<double>(node.m_v[k]);
        square += v[k] * v[k];
      }
      for (int k = 0; k < 3; ++k) {
        const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
        m.momentum[k] += mass * v[k];
        m.angular_momentum[k] += mass * (x[k1] * v[k2] - x[k2] * v[k1]);
      }
      m.kinetic_energy += 0.5 * mass * square;
      m.potential_energy += mass * world.options().gravity * x[1];
      m.impulse_scale += mass * std::sqrt(square);
      m.largest_speed = std::max(m.largest_speed, std::sqrt(square));
      squares += square;
      ++count;
    }
  }
  for (const RigidBody& rigid : world.rigid_bodies()) {
    const btRigidBody& body = *rigid.body;
    if (body.getInvMass() == 0) continue;
    const double mass = 1 / static_cast<double>(body.getInvMass());
    const btVector3 &x = body.getCenterOfMassPosition(), &v = body.getLinearVelocity();
    const btVector3& turning = body.getAngularVelocity();
    const btVector3 spin = body.getInvInertiaTensorWorld().inverse() * turning;
    const btVector3 orbit = x.cross(v);
    for (int k = 0; k < 3; ++k) {
      m.momentum[k] += mass * static_cast<double>(v[k]);
      m.angular_momentum[k] += mass * static_cast<double>(orbit[k]) + static_cast<double>(spin[k]);
    }
    m.kinetic_energy +=
        0.5 * (mass * static_cast<double>(v.length2()) + static_cast<double>(turning.dot(spin)));
    m.potential_energy += mass * world.options().gravity * static_cast<double>(x.y());
    m.impulse_scale += mass * static_cast<double>(v.length());
  }
  if (count > 0) m.rms_speed = std::sqrt(squares / count);
  return m;
}

}  // namespace lazyccd::scenes
