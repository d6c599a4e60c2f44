#include "response/velocities.h"

#include <algorithm>
#include <cmath>

#include "motion/articulated_motion.h"
#include "motion/rotation.h"
#include "response/island_masses.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Soft vertices that a thread takes at a time.
constexpr std::size_t grain = 2048;

// Kinetic energy, joules. The two functions make a velocity of Bullet's velocity and its change.
template <class Velocity, class AngularVelocity>
double kinetic_energy(const Motion& motion, const Velocity& velocity,
                      const AngularVelocity& angular_velocity) {
  double twice = 0;
  for (std::int32_t v = 0; v < motion.soft_count(); ++v) {
    if (motion.inverse_mass()[v] > 0)
      twice += velocity(motion.velocity()[v], motion.velocity_change[v]).squaredNorm() /
               motion.inverse_mass()[v];
  }
  for (const RigidMotion& body : motion.rigid()) {
    if (!body.is_dynamic()) continue;
    const Vector3d omega = angular_velocity(body.angular_velocity, body.angular_velocity_change);
    twice += velocity(body.velocity, body.velocity_change).squaredNorm() * body.mass();
    twice += omega.dot(body.inertia() * omega);
  }
  return 0.5 * twice;
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

ScratchVector<IslandEnergy> kinetic_energies(const Motion& motion, const RowIslands& islands) {
  ScratchVector<IslandEnergy> energies(islands.count());
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(motion.rigid_of_body().size());
       ++body) {
    const std::int32_t island = islands.of_body(body);
    if (island < 0) continue;
    IslandEnergy& energy = energies[island];
    const auto add = [&](double mass, const Vector3d& velocity, const Vector3d& change) {
      energy.before += 0.5 * mass * velocity.squaredNorm();
      energy.after += 0.5 * mass * (velocity + change).squaredNorm();
    };
    if (motion.rigid_of_body()[body] < 0) {
      for (std::int32_t v = motion.first_vertex()[body]; v < motion.first_vertex()[body + 1]; ++v) {
        if (motion.inverse_mass()[v] > 0)
          add(1 / motion.inverse_mass()[v], motion.velocity()[v], motion.velocity_change[v]);
      }
      continue;
    }
    const RigidMotion& rigid = motion.rigid_of(body);
    if (!rigid.is_dynamic()) continue;
    add(rigid.mass(), rigid.velocity, rigid.velocity_change);
    const Vector3d old = rigid.angular_velocity, now = old + rigid.angular_velocity_change;
    energy.before += 0.5 * old.dot(rigid.inertia() * old);
    energy.after += 0.5 * now.dot(rigid.inertia() * now);
  }
  for (const ArticulatedMotion& body : motion.articulated) {
    const std::int32_t island = islands.of_rigid(body.links.front().rigid);
    if (island >= 0) energies[island].after += body.energy_change();
  }
  return energies;
}

bool select_with_energy_gain(const Motion& motion, RowIslands& islands) {
  const ScratchVector<IslandEnergy> energies = kinetic_energies(motion, islands);
  islands.select_none();
  bool any = false;
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(motion.rigid_of_body().size());
       ++body) {
    const std::int32_t island = islands.of_body(body);
    if (island < 0 || energies[island].after <= energies[island].before) continue;
    islands.select_body(body);
    any = true;
  }
  return any;
}

void set_velocities(const Threads& threads, Motion& motion) {
  motion.velocity_change.resize(motion.solved.size());
  threads.parallel_for(motion.solved.size(), grain, [&](std::size_t first, std::size_t last) {
    for (std::size_t v = first; v < last; ++v) {
      motion.velocity_change[v] = (motion.solved[v] - motion.predicted[v]) * motion.rate()[v];
      // An anchored vertex gets its velocity from Bullet's anchor.
      if (motion.inverse_mass()[v] == 0) motion.velocity_change[v].setZero();
    }
  });
  for (const RigidMotion& body : motion.rigid()) {
    RigidSolution& solution = motion.solution_of(body);
    solution.velocity_change = body.translation / motion.dt();
    solution.angular_velocity_change = body.rotation / motion.dt();
  }
  for (ArticulatedMotion& body : motion.articulated) {
    body.set_velocity_change(motion.dt());
  }
}

void restore_angular_momentum(Span<const Island> islands, const Threads& threads, Motion& motion) {
  for (const Island& island : islands) {
    if (!island.free) continue;
    const IslandMasses masses(island, motion, threads);
    struct Moment {
      double mass = 0;
      Vector3d sum = Vector3d::Zero();  // of mass times position
      void include(const Moment& other) {
        mass += other.mass;
        sum += other.sum;
      }
    };
    const Moment moment = masses.sum(Moment(), [](const Mass& m, Moment& to) {
      to.include({m.mass, m.mass * m.position});
    });
    const Vector3d centre = moment.sum / moment.mass;
    // Moments are about the centre of mass. Bodies with different rates do not exchange momentum
    // exactly, so about any other point the loss would contain a part that is no rotation.
    struct Rotation {
      Vector3d lost = Vector3d::Zero();  // angular momentum
      Matrix3d inertia = Matrix3d::Zero();
      void include(const Rotation& other) {
        lost += other.lost;
        inertia += other.inertia;
      }
    };
    const auto [lost, inertia] = masses.sum(Rotation(), [&](const Mass& m, Rotation& to) {
      to.lost += m.mass * (m.predicted - m.position).cross(m.velocity) -
                 m.mass * (m.position - centre).cross(m.change);
      add_inertia(m.mass, m.position - centre, to.inertia);
      if (!m.body) return;
      to.lost -= m.body->inertia() * m.body->angular_velocity_change;
      if (!m.is_carrier) to.inertia += m.body->inertia();
    });
    const Vector3d angular_velocity = rotation_from_momentum(inertia, lost);
    masses.for_each([&](const Mass& m) {
      m.change += angular_velocity.cross(m.position - centre);
      if (m.body && !m.is_carrier) m.solution->angular_velocity_change += angular_velocity;
    });
  }
}

void limit_lever_speeds(Span<const Island> islands, const Threads& threads, Motion& motion) {
  for (const Island& island : islands) {
    if (island.free) continue;
    const IslandMasses masses(island, motion, threads);
    struct Fastest {
      double pusher = 0, any = 0;  // m/s
      void include(const Fastest& other) {
        pusher = std::max(pusher, other.pusher);
        any = std::max(any, other.any);
      }
    };
    const auto [pusher, any] =
        masses.sum(Fastest{island.prescribed_speed, 0}, [](const Mass& m, Fastest& to) {
          const double speed = m.velocity.norm();
          to.include({m.body ? speed : 0, speed});
        });
    if (pusher == 0) continue;
    const double limit = std::max(any, settings::velocity::elastic_factor * pusher);
    masses.for_each([limit](const Mass& m) {
      const Vector3d after = m.velocity + m.change;
      if (!m.body && after.norm() > limit) m.change = limit / after.norm() * after - m.velocity;
    });
  }
}

void limit_kinetic_energy(Span<const Island> islands, const Threads& threads, Motion& motion) {
  for (const Island& island : islands) {
    const IslandMasses masses(island, motion, threads);
    // Twice the energy of velocity + s change is before + 2 s mixed + s^2 quadratic.
    struct Energy {
      double mass = 0, before = 0, mixed = 0, quadratic = 0;
      void include(const Energy& other) {
        mass += other.mass;
        before += other.before;
        mixed += other.mixed;
        quadratic += other.quadratic;
      }
    };
    Energy energy = masses.sum(Energy(), [](const Mass& m, Energy& to) {
      if (!m.change.isZero()) to.mass += m.mass;
      to.before += m.mass * m.velocity.squaredNorm();
      to.mixed += m.mass * m.velocity.dot(m.change);
      to.quadratic += m.mass * m.change.squaredNorm();
      if (!m.body) return;
      const Vector3d &omega = m.body->angular_velocity, &change = m.body->angular_velocity_change;
      // Both orders, as in kinetic_energy(): because of rounding the inertia is not exactly
      // symmetric.
      const Matrix3d inertia = m.body->inertia();
      to.before += omega.dot(inertia * omega);
      to.mixed += 0.5 * omega.dot(inertia * change);
      to.mixed += 0.5 * change.dot(inertia * omega);
      to.quadratic += change.dot(inertia * change);
    });
    for (const int i : island.articulated) {
      const ArticulatedMotion& body = motion.articulated[i];
      energy.mixed += body.mixed_energy();
      energy.quadratic += body.quadratic_energy();
    }
    const double mixed = energy.mixed, quadratic = energy.quadratic;
    // By how much the norm of the velocities may rise; then, the same for twice the energy.
    const double max_gain =
        settings::velocity::elastic_factor * island.prescribed_speed * std::sqrt(energy.mass);
    const double spare = max_gain * (2 * std::sqrt(energy.before) + max_gain);
    if (2 * mixed + quadratic <= spare) continue;
    // Motors that hold all joints leave a change without energy of its own.
    const double scale = quadratic == 0
                             ? spare / (2 * mixed)
                             : (std::sqrt(mixed * mixed + quadratic * spare) - mixed) / quadratic;
    masses.for_each([scale](const Mass& m) {
      m.change *= scale;
      if (m.body) m.solution->angular_velocity_change *= scale;
    });
    for (const int i : island.articulated) motion.articulated[i].scale_velocity_change(scale);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
