// The motion of all vertices over one step, and what the response makes of it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct Motion {
  // Three scalars a vertex, in Bullet's precision, bit for bit what Bullet holds: `end` is what the
  // detector certifies and what Bullet's nodes are then set to.
  std::vector<btScalar> start, end;
  std::vector<double> inverse_mass;  // 1/kg; 0 where something else than contact decides the motion
  std::vector<std::int32_t> first_vertex;  // by body, and one past the last

  // Of the response, metres. `end` is solved + opening, rounded.
  std::vector<Eigen::Vector3d> predicted;  // end of the step as Bullet had it
  std::vector<Eigen::Vector3d> solved;     // after impulses: velocities follow
  std::vector<Eigen::Vector3d> opening;    // moved further to restore a gap: velocities do not

  std::size_t size() const { return inverse_mass.size(); }

  static Eigen::Vector3d read(const std::vector<btScalar>& positions, std::int32_t i) {
    const btScalar* p = &positions[3 * static_cast<std::size_t>(i)];
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
  Eigen::Vector3d start_of(std::int32_t i) const { return read(start, i); }

  void begin_response() {
    predicted.resize(size());
    for (std::size_t i = 0; i < size(); ++i) predicted[i] = read(end, static_cast<std::int32_t>(i));
    solved = predicted;
    opening.assign(size(), Eigen::Vector3d::Zero());
  }

  void round_end(std::int32_t i) {
    const Eigen::Vector3d x = solved[i] + opening[i];
    for (int k = 0; k < 3; ++k)
      end[3 * static_cast<std::size_t>(i) + k] = static_cast<btScalar>(x[k]);
  }

  // Back to the start of the step, exactly.
  void hold(std::int32_t i) {
    solved[i] = start_of(i);
    opening[i].setZero();
    round_end(i);
  }

  Positions starts() const { return {start.data(), size()}; }
  Positions ends() const { return {end.data(), size()}; }
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
