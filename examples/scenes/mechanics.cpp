#include "scenes/mechanics.h"

#include <cmath>

namespace lazyccd::scenes {

Mechanics measure(const PhysicsWorld& world) {
  Mechanics m;
  for (const auto& body : world.bodies()) {
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      const btSoftBody::Node& node = body->m_nodes[i];
      if (node.m_im == 0) continue;
      const double mass = 1 / static_cast<double>(node.m_im);
      double square = 0;
      for (int k = 0; k < 3; ++k) {
        const double v = static_cast<double>(node.m_v[k]);
        m.momentum[k] += mass * v;
        square += v * v;
      }
      m.kinetic_energy += 0.5 * mass * square;
      m.impulse_scale += mass * std::sqrt(square);
    }
  }
  return m;
}

}  // namespace lazyccd::scenes
