// What of an island has a finite mass.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "lazyccd/threads.h"
#include "motion/motion.h"
#include "response/islands.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A soft vertex or rigid body of finite mass.
struct Mass {
  double mass;  ///< kg
  Eigen::Vector3d position,
      predicted;                    ///< of the vertex or the centre of mass, at the end of the step
  const Eigen::Vector3d& velocity;  ///< Bullet's
  Eigen::Vector3d& change;          ///< velocity change of the response
  RigidMotion* body;                ///< null for a vertex
  bool is_carrier = false;          ///< a body in Island::carriers
};

/// The masses of an island in parts, which several threads share. A sum over all of them is the sum
/// over the parts, in their order, so it does not depend on the number of threads.
class IslandMasses {
 public:
  IslandMasses(const Island& island, Motion& motion, const Threads& threads)
      : motion_(motion), threads_(threads) {
    for (const std::int32_t body : island.bodies) {
      if (motion.rigid_of_body[body] >= 0) {
        parts_.push_back({motion.rigid_of_body[body], island.carriers.count(body) > 0, 0, 0});
        continue;
      }
      const std::int32_t last = motion.first_vertex[body + 1];
      for (std::int32_t v = motion.first_vertex[body]; v < last; v += max_vertices)
        parts_.push_back({-1, false, v, std::min(v + max_vertices, last)});
    }
  }

  /// Calls each(Mass) for all masses.
  template <class Each>
  void for_each(const Each& each) const {
    threads_.parallel_for(parts_.size(), parts_of_a_thread,
                          [&](std::size_t first, std::size_t last) {
                            for (std::size_t i = first; i < last; ++i) for_each(parts_[i], each);
                          });
  }
  /// Calls each(Mass, Sum&) for all masses and returns the sum: of `first` and the sums of the
  /// parts, each added with include(const Sum&) and begun as Sum().
  template <class Sum, class Each>
  Sum sum(Sum first, const Each& each) const {
    std::vector<Sum> sums(parts_.size());
    threads_.parallel_for(parts_.size(), parts_of_a_thread,
                          [&](std::size_t begin, std::size_t end) {
                            for (std::size_t i = begin; i < end; ++i)
                              for_each(parts_[i], [&](const Mass& m) { each(m, sums[i]); });
                          });
    for (const Sum& part : sums) first.include(part);
    return first;
  }

 private:
  static constexpr std::int32_t max_vertices = 1024;
  static constexpr std::size_t parts_of_a_thread = 2;

  // A rigid body, or soft vertices (rigid = -1).
  struct Part {
    int rigid;
    bool is_carrier;
    std::int32_t first, last;
  };

  template <class Each>
  void for_each(const Part& part, const Each& each) const {
    if (part.rigid >= 0) {
      RigidMotion& body = motion_.rigid[part.rigid];
      if (!body.is_dynamic()) return;
      each(Mass{body.mass(), to_eigen(body.end.getOrigin()), to_eigen(body.predicted.getOrigin()),
                body.velocity, body.velocity_change, &body, part.is_carrier});
    }
    for (std::int32_t v = part.first; v < part.last; ++v) {
      if (motion_.inverse_mass[v] == 0) continue;
      each(Mass{1 / motion_.inverse_mass[v], motion_.end_of(v), motion_.predicted[v],
                motion_.velocity[v], motion_.velocity_change[v], nullptr});
    }
  }

  Motion& motion_;
  const Threads& threads_;
  std::vector<Part> parts_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
