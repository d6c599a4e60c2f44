#include "response/velocities.h"

#include <algorithm>
#include <cmath>

#include "motion/rotation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Kinetic energy, joules. The two functions make a velocity of Bullet's velocity and its change.
template <class Velocity, class AngularVelocity>
double kinetic_energy(const Motion& motion, const Velocity& velocity,
                      const AngularVelocity& angular_velocity) {
  double twice = 0;
  for (std::int32_t v = 0; v < motion.soft_count(); ++v) {
    if (motion.inverse_mass[v] > 0)
      twice += velocity(motion.velocity[v], motion.velocity_change[v]).squaredNorm() /
               motion.inverse_mass[v];
  }
  for (const RigidMotion& body : motion.rigid) {
    if (!body.is_dynamic()) continue;
    const Vector3d omega = angular_velocity(body.angular_velocity, body.angular_velocity_change);
    twice += velocity(body.velocity, body.velocity_change).squaredNorm() * body.mass();
    twice += omega.dot(body.inertia() * omega);
  }
  return 0.5 * twice;
}

// Calls each(mass, position, predicted position, velocity, velocity change, rigid body or null) for
// everything of finite mass in the island.
template <class Each>
void for_each_mass(const Island& island, Motion& motion, const Each& each) {
  for (const std::int32_t b : island.bodies) {
    if (motion.rigid_of_body[b] >= 0) {
      RigidMotion& body = motion.rigid[motion.rigid_of_body[b]];
      if (!body.is_dynamic()) continue;
      each(body.mass(), to_eigen(body.end.getOrigin()), to_eigen(body.predicted.getOrigin()),
           body.velocity, body.velocity_change, &body);
      continue;
    }
    for (std::int32_t v = motion.first_vertex[b]; v < motion.first_vertex[b + 1]; ++v) {
      if (motion.inverse_mass[v] == 0) continue;
      each(1 / motion.inverse_mass[v], motion.end_of(v), motion.predicted[v], motion.velocity[v],
           motion.velocity_change[v], static_cast<RigidMotion*>(nullptr));
    }
  }
}

}  // namespace

double kinetic_energy_before(const Motion& motion) {
  const auto old = [](const Vector3d& v, const Vector3d&) -> const Vector3d& { return v; };
  return kinetic_energy(motion, old, old);
}

double kinetic_energy_after(const Motion& motion) {
  const auto sum = [](const Vector3d& v, const Vector3d& change) -> Vector3d { return v + change; };
  return kinetic_energy(motion, sum, sum);
}

void set_velocities(Motion& motion) {
  motion.velocity_change.resize(motion.solved.size());
  for (std::size_t v = 0; v < motion.solved.size(); ++v) {
    motion.velocity_change[v] = (motion.solved[v] - motion.predicted[v]) * motion.rate[v];
    // An anchored vertex gets its velocity from Bullet's anchor.
    if (motion.inverse_mass[v] == 0) motion.velocity_change[v].setZero();
  }
  for (RigidMotion& body : motion.rigid) {
    body.velocity_change = body.translation / motion.dt;
    body.angular_velocity_change = body.rotation / motion.dt;
  }
}

void restore_angular_momentum(const std::vector<Island>& islands, Motion& motion) {
  for (const Island& island : islands) {
    if (!island.free) continue;
    double mass = 0;
    Vector3d centre = Vector3d::Zero();
    for_each_mass(island, motion,
                  [&](double m, const Vector3d& position, const Vector3d&, const Vector3d&,
                      const Vector3d&, const RigidMotion*) {
                    mass += m;
                    centre += m * position;
                  });
    centre /= mass;
    // Moments are about the centre of mass. Bodies with different rates do not exchange momentum
    // exactly, so about any other point the loss would contain a part that is no rotation.
    Vector3d lost = Vector3d::Zero();
    Matrix3d inertia = Matrix3d::Zero();
    for_each_mass(island, motion,
                  [&](double m, const Vector3d& position, const Vector3d& predicted,
                      const Vector3d& velocity, const Vector3d& change, const RigidMotion* body) {
                    lost += m * (predicted - position).cross(velocity) -
                            m * (position - centre).cross(change);
                    add_inertia(m, position - centre, inertia);
                    if (!body) return;
                    lost -= body->inertia() * body->angular_velocity_change;
                    inertia += body->inertia();
                  });
    const Vector3d angular_velocity = rotation_from_momentum(inertia, lost);
    for_each_mass(island, motion,
                  [&](double, const Vector3d& position, const Vector3d&, const Vector3d&,
                      Vector3d& change, RigidMotion* body) {
                    change += angular_velocity.cross(position - centre);
                    if (body) body->angular_velocity_change += angular_velocity;
                  });
  }
}

void limit_kinetic_energy(const std::vector<Island>& islands, Motion& motion) {
  for (const Island& island : islands) {
    // Twice the energy of velocity + s change is before + 2 s mixed + s^2 quadratic.
    double mass = 0, before = 0, mixed = 0, quadratic = 0;
    const auto add = [&](double m, const Vector3d& velocity, const Vector3d& change) {
      before += m * velocity.squaredNorm();
      mixed += m * velocity.dot(change);
      quadratic += m * change.squaredNorm();
    };
    for_each_mass(
        island, motion,
        [&](double m, const Vector3d&, const Vector3d&, const Vector3d& velocity,
            const Vector3d& change, const RigidMotion* body) {
          if (!change.isZero(0)) mass += m;
          add(m, velocity, change);
          if (!body) return;
          // Both orders, as in kinetic_energy(): because of rounding the inertia is not
          // exactly symmetric.
          const Matrix3d inertia = body->inertia();
          before += body->angular_velocity.dot(inertia * body->angular_velocity);
          mixed += 0.5 * body->angular_velocity.dot(inertia * body->angular_velocity_change);
          mixed += 0.5 * body->angular_velocity_change.dot(inertia * body->angular_velocity);
          quadratic += body->angular_velocity_change.dot(inertia * body->angular_velocity_change);
        });
    // By how much the norm of the velocities may rise; then, the same for twice the energy.
    const double max_gain = 2 * island.prescribed_speed * std::sqrt(mass);
    const double spare = max_gain * (2 * std::sqrt(before) + max_gain);
    if (2 * mixed + quadratic <= spare) continue;
    const double scale = (std::sqrt(mixed * mixed + quadratic * spare) - mixed) / quadratic;
    for_each_mass(island, motion,
                  [&](double, const Vector3d&, const Vector3d&, const Vector3d&, Vector3d& change,
                      RigidMotion* body) {
                    change *= scale;
                    if (body) body->angular_velocity_change *= scale;
                  });
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
