#include "response/rest_damping.h"

#include <algorithm>
#include <cmath>

#include "contact/contact_checks.h"
#include "motion/rotation.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

namespace {

// Sums over the nodes of a body. Positions and velocities are relative to those of one node, so
// that the differences below lose no digits.
struct NodeSums {
  double mass = 0, squared_speed = 0;  // kg; mass times squared speed
  Vector3d position = Vector3d::Zero(), velocity = Vector3d::Zero();  // times mass
  Matrix3d position_products = Matrix3d::Zero();                      // x x^T times mass
  Vector3d angular_momentum = Vector3d::Zero();

  void add(double m, const Vector3d& x, const Vector3d& v) {
    mass += m;
    squared_speed += m * v.squaredNorm();
    position += m * x;
    velocity += m * v;
    position_products += (m * x) * x.transpose();
    angular_momentum += (m * x).cross(v);
  }
};

// Whether friction is all that Coulomb's cone allows, so that the contact slides.
bool slides(const ContactRow& row) {
  // The sweeps, in single precision, end on the cone: its length, a quotient and three products.
  const double limit = row.friction * row.normal_impulse;
  return limit > 0 && row.sliding_fraction == 0 &&
         row.tangent_impulse.norm() >= (1 - roundings<float>(4)) * limit;
}

// What the contacts of a body carry, kg m.
struct Load {
  double all = 0, sliding = 0;
};

// `sticking`: part of the load whose contacts do not slide.
void damp_deformation(std::size_t body, double sticking, double rate, double rest_speed,
                      Motion& motion) {
  const std::int32_t first = motion.first_vertex()[body], last = motion.first_vertex()[body + 1];
  const Vector3d origin = motion.end_of(first), origin_velocity = motion.velocity()[first];
  const auto velocity = [&](std::int32_t v) -> Vector3d {
    return motion.velocity()[v] + motion.velocity_change[v] - origin_velocity;
  };
  NodeSums sums;
  for (std::int32_t v = first; v < last; ++v) {
    if (motion.inverse_mass()[v] > 0)
      sums.add(1 / motion.inverse_mass()[v], motion.end_of(v) - origin, velocity(v));
  }
  if (sums.mass == 0) return;
  const Vector3d centre = sums.position / sums.mass, mean_velocity = sums.velocity / sums.mass;
  // About the centre of mass, by Huygens and Steiner.
  const Matrix3d products = sums.position_products - sums.position * centre.transpose();
  const Matrix3d inertia = products.trace() * Matrix3d::Identity() - products;
  const Vector3d angular_momentum = sums.angular_momentum - sums.position.cross(mean_velocity);
  const double square_sum = sums.squared_speed - sums.velocity.dot(mean_velocity);
  const double limit = rest_speed * rest_speed * sums.mass;
  const Vector3d angular_velocity = rotation_from_momentum(inertia, angular_momentum);
  // What is left is without the energy of the rotation, by Koenig.
  const double deformation_square_sum =
      std::max(0.0, square_sum - angular_velocity.dot(angular_momentum));
  if (deformation_square_sum >= limit) return;
  const double fraction =
      sticking * (1 - std::exp(-rate * motion.dt())) * (1 - deformation_square_sum / limit);
  for (std::int32_t v = first; v < last; ++v) {
    if (motion.inverse_mass()[v] == 0) continue;
    const Vector3d arm = motion.end_of(v) - origin - centre;
    motion.velocity_change[v] -=
        fraction * (velocity(v) - mean_velocity - angular_velocity.cross(arm));
  }
}

}  // namespace

void damp_deformation(const std::vector<const ContactRow*>& rows, double rate, double rest_speed,
                      const Threads& threads, Motion& motion) {
  ScratchVector<Load> loads(motion.rigid_of_body().size());
  for (const ContactRow* const row : rows) {
    for (const std::int32_t body : {row->contact.body_a, row->contact.body_b}) {
      loads[body].all += row->normal_impulse;
      if (slides(*row)) loads[body].sliding += row->normal_impulse;
    }
  }
  constexpr std::size_t min_vertices = 4096;  // of a range of bodies
  const std::size_t grain = 1 + min_vertices * loads.size() / (1 + motion.velocity().size());
  threads.parallel_for(loads.size(), grain, [&](std::size_t first, std::size_t last) {
    for (std::size_t body = first; body < last; ++body) {
      const Load& load = loads[body];
      if (load.all > load.sliding && motion.rigid_of_body()[body] < 0)
        damp_deformation(body, 1 - load.sliding / load.all, rate, rest_speed, motion);
    }
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
