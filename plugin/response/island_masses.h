// What of an island has a finite mass.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>

#include "lazyccd/threads.h"
#include "motion/motion.h"
#include "response/islands.h"
#include "response/part_sums.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A soft vertex or rigid body of finite mass.
struct Mass {
  double mass;  ///< kg
  Vector3d position,
      predicted;             ///< of the vertex or the centre of mass, at the end of the step
  const Vector3d& velocity;  ///< Bullet's
  Vector3d& change;          ///< velocity change of the response
  const RigidMotion* body;   ///< null for a vertex
  RigidSolution* solution;   ///< of the body
  bool is_carrier = false;   ///< as in MassRange
};

/// The masses of an island in its parts, which several threads share. A sum over all of them is the
/// sum over the parts, in their order, so it does not depend on the number of threads. The
/// arguments of the constructor must outlive the object.
class IslandMasses {
 public:
  IslandMasses(const Island& island, Motion& motion, const Threads& threads)
      : island_(island), motion_(motion), threads_(threads) {}

  /// Calls each(Mass) for all masses.
  template <class Each>
  void for_each(const Each& each) const {
    for_each_part([&](std::size_t part) { for_each_of(part, each); });
  }
  /// Calls each(Mass, Sum&) for all masses and returns the sum: of `first` and the sums of the
  /// parts, each added with include(const Sum&) and begun as Sum().
  template <class Sum, class Each>
  Sum sum(Sum first, const Each& each) const {
    const auto sum_of = [&](std::size_t part) {
      Sum sum;
      for_each_of(part, [&](const Mass& m) { each(m, sum); });
      return sum;
    };
    return sum_of_parts(threads_, part_count(), std::move(first), sum_of);
  }

 private:
  std::size_t part_count() const { return island_.parts.size() - 1; }
  template <class Each>
  void for_each_part(const Each& each) const {
    if (part_count() == 1) return each(0);
    threads_.parallel_for(part_count(), 2, [&](std::size_t first, std::size_t last) {
      for (std::size_t part = first; part < last; ++part) each(part);
    });
  }
  template <class Each>
  void for_each_of(std::size_t part, const Each& each) const {
    for (std::size_t i = island_.parts[part]; i < island_.parts[part + 1]; ++i)
      for_each_of(island_.masses[i], each);
  }
  template <class Each>
  void for_each_of(const MassRange& range, const Each& each) const {
    if (range.rigid >= 0) {
      const RigidMotion& body = motion_.rigid()[range.rigid];
      if (!body.is_dynamic()) return;
      RigidSolution& solution = motion_.solution_of(body);
      each(Mass{body.mass(), to_double(body.end.getOrigin()), to_double(body.predicted.getOrigin()),
                body.velocity, solution.velocity_change, &body, &solution, range.is_carrier});
    }
    for (std::int32_t v = range.first; v < range.last; ++v) {
      if (motion_.inverse_mass()[v] == 0) continue;
      each(Mass{1 / motion_.inverse_mass()[v], motion_.end_of(v), motion_.predicted[v],
                motion_.velocity()[v], motion_.velocity_change[v], nullptr, nullptr});
    }
  }

  const Island& island_;
  Motion& motion_;
  const Threads& threads_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
