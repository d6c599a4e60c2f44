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

// A soft vertex or rigid body of finite mass.
struct Mass {
  double mass;                   // kg
  Vector3d position, predicted;  // of the vertex or the centre of mass, at the end of the step
  const Vector3d& velocity;      // Bullet's
  Vector3d& change;              // velocity change of the response
  RigidMotion* body;             // null for a vertex
  bool is_carrier = false;       // a body in Island::carriers
};

// Calls each(Mass) for everything of finite mass in the island.
template <class Each>
void for_each_mass(const Island& island, Motion& motion, const Each& each) {
  for (const std::int32_t b : island.bodies) {
    if (motion.rigid_of_body[b] >= 0) {
      RigidMotion& body = motion.rigid[motion.rigid_of_body[b]];
      if (!body.is_dynamic()) continue;
      each(Mass{body.mass(), to_eigen(body.end.getOrigin()), to_eigen(body.predicted.getOrigin()),
                body.velocity, body.velocity_change, &body, island.carriers.count(b) > 0});
      continue;
    }
    for (std::int32_t v = motion.first_vertex[b]; v < motion.first_vertex[b + 1]; ++v) {
      if (motion.inverse_mass[v] == 0) continue;
      each(Mass{1 / motion.inverse_mass[v], motion.end_of(v), motion.predicted[v],
                motion.velocity[v], motion.velocity_change[v], nullptr});
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
  double energy = kinetic_energy(motion, sum, sum);
  for (const ArticulatedMotion& body : motion.articulated) energy += body.energy_change();
  return energy;
}

bool select_with_energy_gain(const Motion& motion, RowIslands& islands) {
  std::vector<double> before(islands.count(), 0), after(islands.count(), 0);  // twice the energies
  islands.select_none();
  const auto bodies = static_cast<std::int32_t>(motion.rigid_of_body.size());
  for (std::int32_t body = 0; body < bodies; ++body) {
    const std::int32_t island = islands.of_body(body);
    if (island < 0) continue;
    const auto add = [&](double mass, const Vector3d& velocity, const Vector3d& change) {
      before[island] += mass * velocity.squaredNorm();
      after[island] += mass * (velocity + change).squaredNorm();
    };
    if (motion.rigid_of_body[body] < 0) {
      for (std::int32_t v = motion.first_vertex[body]; v < motion.first_vertex[body + 1]; ++v) {
        if (motion.inverse_mass[v] > 0)
          add(1 / motion.inverse_mass[v], motion.velocity[v], motion.velocity_change[v]);
      }
      continue;
    }
    const RigidMotion& rigid = motion.rigid_of(body);
    if (!rigid.is_dynamic()) continue;
    add(rigid.mass(), rigid.velocity, rigid.velocity_change);
    const Vector3d old = rigid.angular_velocity, now = old + rigid.angular_velocity_change;
    before[island] += old.dot(rigid.inertia() * old);
    after[island] += now.dot(rigid.inertia() * now);
  }
  for (const ArticulatedMotion& body : motion.articulated) {
    const std::int32_t island = islands.of_rigid(body.links.front().rigid);
    if (island >= 0) after[island] += 2 * body.energy_change();
  }
  bool any = false;
  for (std::int32_t body = 0; body < bodies; ++body) {
    const std::int32_t island = islands.of_body(body);
    if (island < 0 || after[island] <= before[island]) continue;
    islands.select_body(body);
    any = true;
  }
  return any;
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
  for (ArticulatedMotion& body : motion.articulated) {
    body.velocity_change = body.displacement / motion.dt;
    body.momentum_change = body.impulse / motion.dt;
  }
}

void restore_angular_momentum(const std::vector<Island>& islands, Motion& motion) {
  for (const Island& island : islands) {
    if (!island.free) continue;
    double mass = 0;
    Vector3d centre = Vector3d::Zero();
    for_each_mass(island, motion, [&](const Mass& m) {
      mass += m.mass;
      centre += m.mass * m.position;
    });
    centre /= mass;
    // Moments are about the centre of mass. Bodies with different rates do not exchange momentum
    // exactly, so about any other point the loss would contain a part that is no rotation.
    Vector3d lost = Vector3d::Zero();
    Matrix3d inertia = Matrix3d::Zero();
    for_each_mass(island, motion, [&](const Mass& m) {
      lost += m.mass * (m.predicted - m.position).cross(m.velocity) -
              m.mass * (m.position - centre).cross(m.change);
      add_inertia(m.mass, m.position - centre, inertia);
      if (!m.body) return;
      lost -= m.body->inertia() * m.body->angular_velocity_change;
      if (!m.is_carrier) inertia += m.body->inertia();
    });
    const Vector3d angular_velocity = rotation_from_momentum(inertia, lost);
    for_each_mass(island, motion, [&](const Mass& m) {
      m.change += angular_velocity.cross(m.position - centre);
      if (m.body && !m.is_carrier) m.body->angular_velocity_change += angular_velocity;
    });
  }
}

void limit_lever_speeds(const std::vector<Island>& islands, Motion& motion) {
  for (const Island& island : islands) {
    if (island.free) continue;
    double pusher = island.prescribed_speed, limit = 0;
    for_each_mass(island, motion, [&](const Mass& m) {
      if (m.body) pusher = std::max(pusher, m.velocity.norm());
      limit = std::max(limit, m.velocity.norm());
    });
    if (pusher == 0) continue;
    limit = std::max(limit, 2 * pusher);
    for_each_mass(island, motion, [&](const Mass& m) {
      const Vector3d after = m.velocity + m.change;
      if (!m.body && after.norm() > limit) m.change = limit / after.norm() * after - m.velocity;
    });
  }
}

void limit_kinetic_energy(const std::vector<Island>& islands, Motion& motion) {
  for (const Island& island : islands) {
    // Twice the energy of velocity + s change is before + 2 s mixed + s^2 quadratic.
    double mass = 0, before = 0, mixed = 0, quadratic = 0;
    for_each_mass(island, motion, [&](const Mass& m) {
      if (!m.change.isZero(0)) mass += m.mass;
      before += m.mass * m.velocity.squaredNorm();
      mixed += m.mass * m.velocity.dot(m.change);
      quadratic += m.mass * m.change.squaredNorm();
      if (!m.body) return;
      const Vector3d &omega = m.body->angular_velocity, &change = m.body->angular_velocity_change;
      // Both orders, as in kinetic_energy(): because of rounding the inertia is not exactly
      // symmetric.
      const Matrix3d inertia = m.body->inertia();
      before += omega.dot(inertia * omega);
      mixed += 0.5 * omega.dot(inertia * change);
      mixed += 0.5 * change.dot(inertia * omega);
      quadratic += change.dot(inertia * change);
    });
    for (const int i : island.articulated) {
      const ArticulatedMotion& body = motion.articulated[i];
      mixed += body.momentum_change.dot(body.velocity);
      quadratic += body.momentum_change.dot(body.velocity_change);
    }
    // By how much the norm of the velocities may rise; then, the same for twice the energy.
    const double max_gain = 2 * island.prescribed_speed * std::sqrt(mass);
    const double spare = max_gain * (2 * std::sqrt(before) + max_gain);
    if (2 * mixed + quadratic <= spare) continue;
    const double scale = (std::sqrt(mixed * mixed + quadratic * spare) - mixed) / quadratic;
    for_each_mass(island, motion, [&](const Mass& m) {
      m.change *= scale;
      if (m.body) m.body->angular_velocity_change *= scale;
    });
    for (const int i : island.articulated) {
      motion.articulated[i].velocity_change *= scale;
      motion.articulated[i].momentum_change *= scale;
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
