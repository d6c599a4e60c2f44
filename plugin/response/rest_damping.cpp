#include "response/rest_damping.h"

#include <cmath>

#include "motion/rotation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void damp_deformation(const std::vector<const ContactRow*>& rows, double rate, double rest_speed,
                      Motion& motion) {
  std::vector<char> loaded(motion.rigid_of_body.size(), 0);
  for (const ContactRow* const row : rows) {
    if (row->normal_impulse > 0) loaded[row->contact.body_a] = loaded[row->contact.body_b] = 1;
  }
  for (std::size_t body = 0; body < loaded.size(); ++body) {
    if (!loaded[body] || motion.rigid_of_body[body] >= 0) continue;
    const auto for_each_node = [&](const auto& each) {
      for (std::int32_t v = motion.first_vertex[body]; v < motion.first_vertex[body + 1]; ++v) {
        if (motion.inverse_mass[v] > 0) each(v, 1 / motion.inverse_mass[v], motion.end_of(v));
      }
    };
    const auto velocity = [&](std::int32_t v) -> Vector3d {
      return motion.velocity[v] + motion.velocity_change[v];
    };
    double mass = 0;
    Vector3d centre = Vector3d::Zero(), drift = Vector3d::Zero(), turning = Vector3d::Zero();
    for_each_node([&](std::int32_t v, double m, const Vector3d& place) {
      mass += m;
      centre += m * place;
      drift += m * velocity(v);
    });
    if (mass == 0) continue;
    centre /= mass;
    drift /= mass;
    Matrix3d inertia = Matrix3d::Zero();
    for_each_node([&](std::int32_t v, double m, const Vector3d& place) {
      add_inertia(m, place - centre, inertia);
      turning += m * (place - centre).cross(velocity(v));
    });
    const Vector3d angular_velocity = turn_of(inertia, turning);
    const auto deforming = [&](std::int32_t v, const Vector3d& place) -> Vector3d {
      return velocity(v) - drift - angular_velocity.cross(place - centre);
    };
    double squares = 0;
    for_each_node([&](std::int32_t v, double m, const Vector3d& place) {
      squares += m * deforming(v, place).squaredNorm();
    });
    const double limit = rest_speed * rest_speed * mass;
    if (squares >= limit) continue;
    const double part = (1 - std::exp(-rate * motion.dt)) * (1 - squares / limit);
    for_each_node([&](std::int32_t v, double, const Vector3d& place) {
      motion.velocity_change[v] -= part * deforming(v, place);
    });
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
