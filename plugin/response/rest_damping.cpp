#include "response/rest_damping.h"

#include <cmath>

#include "motion/rotation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

void damp_deformation(std::size_t body, double rate, double rest_speed, Motion& motion) {
  const auto for_each_node = [&](const auto& visit) {
    for (std::int32_t v = motion.first_vertex[body]; v < motion.first_vertex[body + 1]; ++v) {
      if (motion.inverse_mass[v] > 0) visit(v, 1 / motion.inverse_mass[v], motion.end_of(v));
    }
  };
  const auto velocity = [&](std::int32_t v) -> Vector3d {
    return motion.velocity[v] + motion.velocity_change[v];
  };
  double mass = 0;
  Vector3d centre = Vector3d::Zero(), mean_velocity = Vector3d::Zero(),
           angular_momentum = Vector3d::Zero();
  for_each_node([&](std::int32_t v, double m, const Vector3d& position) {
    mass += m;
    centre += m * position;
    mean_velocity += m * velocity(v);
  });
  if (mass == 0) return;
  centre /= mass;
  mean_velocity /= mass;
  Matrix3d inertia = Matrix3d::Zero();
  for_each_node([&](std::int32_t v, double m, const Vector3d& position) {
    add_inertia(m, position - centre, inertia);
    angular_momentum += m * (position - centre).cross(velocity(v));
  });
  const Vector3d angular_velocity = rotation_from_momentum(inertia, angular_momentum);
  const auto deformation_velocity = [&](std::int32_t v, const Vector3d& position) -> Vector3d {
    return velocity(v) - mean_velocity - angular_velocity.cross(position - centre);
  };
  double weighted_square_sum = 0;
  for_each_node([&](std::int32_t v, double m, const Vector3d& position) {
    weighted_square_sum += m * deformation_velocity(v, position).squaredNorm();
  });
  const double limit = rest_speed * rest_speed * mass;
  if (weighted_square_sum >= limit) return;
  const double fraction = (1 - std::exp(-rate * motion.dt)) * (1 - weighted_square_sum / limit);
  for_each_node([&](std::int32_t v, double, const Vector3d& position) {
    motion.velocity_change[v] -= fraction * deformation_velocity(v, position);
  });
}

}  // namespace

void damp_deformation(const std::vector<const ContactRow*>& rows, double rate, double rest_speed,
                      const Threads& threads, Motion& motion) {
  std::vector<char> loaded(motion.rigid_of_body.size(), 0);
  for (const ContactRow* const row : rows) {
    if (row->normal_impulse > 0) loaded[row->contact.body_a] = loaded[row->contact.body_b] = 1;
  }
  constexpr std::size_t min_vertices = 4096;  // of a range of bodies
  const std::size_t grain = 1 + min_vertices * loaded.size() / (1 + motion.velocity.size());
  threads.parallel_for(loaded.size(), grain, [&](std::size_t first, std::size_t last) {
    for (std::size_t body = first; body < last; ++body) {
      if (loaded[body] && motion.rigid_of_body[body] < 0)
        damp_deformation(body, rate, rest_speed, motion);
    }
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
