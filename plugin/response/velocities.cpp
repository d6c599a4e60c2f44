#include "response/velocities.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "response/contact_solver.h"
#include "response/contact_constraints.h"
#include "motion/rotation.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

template <class Velocity, class Spin>
double kinetic_energy(const Motion& motion, const Velocity& velocity, const Spin& spin) {
  double twice = 0;
  for (std::int32_t v = 0; v < motion.soft_count(); ++v) {
    if (motion.inverse_mass[v] > 0)
      twice += velocity(motion.velocity[v], motion.velocity_change[v]).squaredNorm() /
               motion.inverse_mass[v];
  }
  for (const RigidMotion& body : motion.rigid) {
    if (!body.is_dynamic()) continue;
    const Vector3d turning = spin(body.spin, body.spin_change);
    twice += velocity(body.velocity, body.velocity_change).squaredNorm() * body.mass();
    twice += turning.dot(body.inertia() * turning);
  }
  return 0.5 * twice;
}

// Bullet moves kinematic bodies once a frame, in the first of its substeps, and knows their speed.
// Where it does not, they were put elsewhere.
double drive_of(std::int32_t v, const RigidMotion* body, const Motion& motion) {
  const double moved = (motion.end_of(v) - motion.start_of(v)).norm() / motion.seconds;
  if (!body || (body->velocity.isZero(0) && body->spin.isZero(0))) return moved;
  const Vector3d arm = motion.start_of(v) - body->centre();
  return std::min(moved, (body->velocity + body->spin.cross(arm)).norm());
}

// Calls each(mass, place, predicted place, velocity, velocity change, rigid body or null) for what
// has a finite mass.
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

std::vector<Island> find_islands(const std::vector<const ContactRow*>& rows, const Motion& motion) {
  std::vector<std::int32_t> parent(motion.rigid_of_body.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](std::int32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<char> in_contact(parent.size(), 0);
  for (const ContactRow* const row : rows) {
    in_contact[row->contact.body_a] = in_contact[row->contact.body_b] = 1;
    parent[find(row->contact.body_a)] = find(row->contact.body_b);
  }
  // What an anchor fixes to a rigid body pushes that.
  for (const auto& [vertex, carried] : motion.carried) {
    const auto next =
        std::upper_bound(motion.first_vertex.begin(), motion.first_vertex.end(), vertex);
    const auto body = static_cast<std::int32_t>(next - motion.first_vertex.begin()) - 1;
    if (!in_contact[body]) continue;
    const auto carrier =
        std::find(motion.rigid_of_body.begin(), motion.rigid_of_body.end(), carried.rigid);
    const auto rigid_body = static_cast<std::int32_t>(carrier - motion.rigid_of_body.begin());
    in_contact[rigid_body] = 1;
    parent[find(body)] = find(rigid_body);
  }
  std::map<std::int32_t, Island> islands;
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(parent.size()); ++body) {
    if (!in_contact[body]) continue;
    Island& island = islands[find(body)];
    island.bodies.push_back(body);
    const int rigid = motion.rigid_of_body[body];
    if (rigid >= 0 && motion.rigid[rigid].is_dynamic()) {
      island.free = island.free && !motion.rigid[rigid].is_locked();
      continue;
    }
    for (std::int32_t v = motion.first_vertex[body]; v < motion.first_vertex[body + 1]; ++v) {
      if (motion.is_free(v) || (motion.is_soft(v) && motion.carrier_of(v) >= 0)) continue;
      island.free = false;
      const RigidMotion* const driven = rigid >= 0 ? &motion.rigid[rigid] : nullptr;
      island.drive = std::max(island.drive, drive_of(v, driven, motion));
    }
  }
  std::vector<Island> result;
  for (const auto& island : islands) result.push_back(island.second);
  return result;
}

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
    // What is carried gets its velocity from Bullet's anchor.
    if (motion.inverse_mass[v] == 0) motion.velocity_change[v].setZero();
  }
  for (RigidMotion& body : motion.rigid) {
    body.velocity_change = body.shift / motion.seconds;
    body.spin_change = body.turn / motion.seconds;
  }
}

void add_restitution(RowList& rows, double restitution, double threshold, int sweeps,
                     Motion& motion) {
  // The rows' impulses say nothing about it: they also carry what presses on a contact, and zones
  // may have moved it in their place. So the rows are solved once more, for the gaps that what
  // bounces is to have.
  Motion next = motion;
  next.solved.assign(motion.predicted.begin(), motion.predicted.begin() + motion.soft_count());
  std::vector<ContactRow> bouncing;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!rows.gives_way(i)) continue;
    rows.copy(i, bouncing);
    ContactRow& row = bouncing.back();
    double predicted = 0;
    for (int k = 0; k < 4; ++k)
      predicted += row.weights[k] * row.normal.dot(motion.predicted[row.contact.vertices[k]]);
    const double solved = row.normal.dot(separation(row, motion));
    const double approach = row.start_gap - predicted;
    const bool bounces = row.impulse > 0 && approach >= threshold * motion.seconds;
    const double wanted =
        bounces ? row.start_gap + restitution * approach : std::min(row.kept_gap, solved);
    row.kept_gap = predicted + wanted - solved;
    row.impulse = row.friction = 0;
    row.tangential.setZero();
  }
  RowList list(std::move(bouncing));
  ContactProblem problem;
  problem.set_up(ContactProblem::Of::motion, list, next);
  problem.solve(sweeps);
  problem.write(next);
  const auto add = [&](double part) {
    for (std::size_t v = 0; v < next.solved.size(); ++v)
      motion.velocity_change[v] += part * motion.rate[v] * (next.solved[v] - motion.predicted[v]);
    for (std::size_t b = 0; b < next.rigid.size(); ++b) {
      motion.rigid[b].velocity_change += part / motion.seconds * next.rigid[b].shift;
      motion.rigid[b].spin_change += part / motion.seconds * next.rigid[b].turn;
    }
  };
  // The energy is quadratic in the part: up to where it is what it was before the contact.
  const double without = kinetic_energy_after(motion);
  add(0.5);
  const double with_half = kinetic_energy_after(motion);
  add(0.5);
  const double with_all = kinetic_energy_after(motion);
  const double spare = std::max(0.0, kinetic_energy_before(motion) - without);
  if (with_all - without <= spare) return;
  const double square = 2 * (with_all - 2 * with_half + without);
  const double linear = with_all - without - square;
  const double root = std::sqrt(std::max(0.0, linear * linear + 4 * square * spare));
  // The stable form of (root - linear) / (2 square).
  const double part = linear > 0 ? 2 * spare / (linear + root) : 0.5 * (root - linear) / square;
  add(part - 1);
}

void restore_angular_momentum(const std::vector<Island>& islands, Motion& motion) {
  for (const Island& island : islands) {
    if (!island.free) continue;
    double mass = 0;
    Vector3d centre = Vector3d::Zero();
    for_each_mass(island, motion,
                  [&](double m, const Vector3d& place, const Vector3d&, const Vector3d&,
                      const Vector3d&, const RigidMotion*) {
                    mass += m;
                    centre += m * place;
                  });
    centre /= mass;
    // About the centre: bodies with different rates lose momentum to each other, so that about any
    // other point there is a part that is no spin.
    Vector3d lost = Vector3d::Zero();
    Matrix3d inertia = Matrix3d::Zero();
    for_each_mass(island, motion,
                  [&](double m, const Vector3d& place, const Vector3d& predicted,
                      const Vector3d& velocity, const Vector3d& change, const RigidMotion* body) {
                    lost += m * (predicted - place).cross(velocity) -
                            m * (place - centre).cross(change);
                    add_inertia(m, place - centre, inertia);
                    if (!body) return;
                    lost -= body->inertia() * body->spin_change;
                    inertia += body->inertia();
                  });
    const Vector3d spin = turn_of(inertia, lost);
    for_each_mass(island, motion,
                  [&](double, const Vector3d& place, const Vector3d&, const Vector3d&,
                      Vector3d& change, RigidMotion* body) {
                    change += spin.cross(place - centre);
                    if (body) body->spin_change += spin;
                  });
  }
}

void limit_kinetic_energy(const std::vector<Island>& islands, Motion& motion) {
  for (const Island& island : islands) {
    // Twice the energy of velocity + s change is before + 2 s across + s^2 along.
    double mass = 0, before = 0, across = 0, along = 0;
    const auto add = [&](double m, const Vector3d& velocity, const Vector3d& change) {
      before += m * velocity.squaredNorm();
      across += m * velocity.dot(change);
      along += m * change.squaredNorm();
    };
    for_each_mass(island, motion,
                  [&](double m, const Vector3d&, const Vector3d&, const Vector3d& velocity,
                      const Vector3d& change, const RigidMotion* body) {
                    if (!change.isZero(0)) mass += m;
                    add(m, velocity, change);
                    if (!body) return;
                    // As the energy has it: rounded, the inertia is not quite symmetric.
                    const Matrix3d inertia = body->inertia();
                    before += body->spin.dot(inertia * body->spin);
                    across += 0.5 * body->spin.dot(inertia * body->spin_change);
                    across += 0.5 * body->spin_change.dot(inertia * body->spin);
                    along += body->spin_change.dot(inertia * body->spin_change);
                  });
    const double driven = 2 * island.drive * std::sqrt(mass);
    const double spare = driven * (2 * std::sqrt(before) + driven);
    if (2 * across + along <= spare) continue;
    const double part = (std::sqrt(across * across + along * spare) - across) / along;
    for_each_mass(island, motion,
                  [&](double, const Vector3d&, const Vector3d&, const Vector3d&, Vector3d& change,
                      RigidMotion* body) {
                    change *= part;
                    if (body) body->spin_change *= part;
                  });
  }
}

void damp_deformation(const std::vector<const ContactRow*>& rows, double rate, double rest_speed,
                      Motion& motion) {
  std::vector<char> loaded(motion.rigid_of_body.size(), 0);
  for (const ContactRow* const row : rows) {
    if (row->impulse > 0) loaded[row->contact.body_a] = loaded[row->contact.body_b] = 1;
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
    const Vector3d spin = turn_of(inertia, turning);
    const auto deforming = [&](std::int32_t v, const Vector3d& place) -> Vector3d {
      return velocity(v) - drift - spin.cross(place - centre);
    };
    double squares = 0;
    for_each_node([&](std::int32_t v, double m, const Vector3d& place) {
      squares += m * deforming(v, place).squaredNorm();
    });
    const double limit = rest_speed * rest_speed * mass;
    if (squares >= limit) continue;
    const double part = (1 - std::exp(-rate * motion.seconds)) * (1 - squares / limit);
    for_each_node([&](std::int32_t v, double, const Vector3d& place) {
      motion.velocity_change[v] -= part * deforming(v, place);
    });
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
