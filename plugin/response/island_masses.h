// What of an island has a finite mass.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "lazyccd/threads.h"
#include "motion/motion.h"
#include "response/islands.h"
#include "util/matrix.h"
#include "util/part_sums.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A soft vertex or rigid body of finite mass.
struct Mass {
  double mass;  ///< kg
  Vector3d position,
      predicted;             ///< of the vertex or the centre of mass, at the end of the step
  const Vector3d& velocity;  ///< Bullet's
  Vector3d& change;          ///< velocity change of the response
  RigidMotion* body;         ///< null for a vertex
  bool is_carrier = false;   ///< a body in Island::carriers
};

/// The masses of an island in parts of about a thousand, which several threads share. A sum over
/// all of them is the sum over the parts, in their order, so it does not depend on the number of
/// threads. The arguments of the constructor must outlive the object.
class IslandMasses {
 public:
  IslandMasses(const Island& of_island, Motion& motion, const Threads& threads)
      : island(of_island), motion_(motion), threads_(threads) {
    std::int32_t count = part_size;  // of the last part; full, so that the first range begins one
    const auto add = [&](const Range& range, std::int32_t size) {
      if (count + size > part_size) {
        first_.push_back(ranges_.size());
        count = 0;
      }
      ranges_.push_back(range);
      count += size;
    };
    for (const std::int32_t body : island.bodies) {
      if (motion.rigid_of_body[body] >= 0) {
        add({motion.rigid_of_body[body], island.carriers.count(body) > 0, 0, 0}, 1);
        continue;
      }
      const std::int32_t last = motion.first_vertex[body + 1];
      for (std::int32_t v = motion.first_vertex[body]; v < last; v += part_size) {
        const std::int32_t next = std::min(v + part_size, last);
        add({-1, false, v, next}, next - v);
      }
    }
    first_.push_back(ranges_.size());
  }

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

  const Island& island;

 private:
  static constexpr std::int32_t part_size = 1024;

  // A rigid body, or soft vertices of one body (rigid = -1).
  struct Range {
    int rigid;
    bool is_carrier;
    std::int32_t first, last;
  };

  std::size_t part_count() const { return first_.size() - 1; }
  template <class Each>
  void for_each_part(const Each& each) const {
    if (part_count() == 1) return each(0);
    threads_.parallel_for(part_count(), 2, [&](std::size_t first, std::size_t last) {
      for (std::size_t part = first; part < last; ++part) each(part);
    });
  }
  template <class Each>
  void for_each_of(std::size_t part, const Each& each) const {
    for (std::size_t i = first_[part]; i < first_[part + 1]; ++i) for_each_of(ranges_[i], each);
  }
  template <class Each>
  void for_each_of(const Range& range, const Each& each) const {
    if (range.rigid >= 0) {
      RigidMotion& body = motion_.rigid[range.rigid];
      if (!body.is_dynamic()) return;
      each(Mass{body.mass(), to_double(body.end.getOrigin()), to_double(body.predicted.getOrigin()),
                body.velocity, body.velocity_change, &body, range.is_carrier});
    }
    for (std::int32_t v = range.first; v < range.last; ++v) {
      if (motion_.inverse_mass[v] == 0) continue;
      each(Mass{1 / motion_.inverse_mass[v], motion_.end_of(v), motion_.predicted[v],
                motion_.velocity[v], motion_.velocity_change[v], nullptr});
    }
  }

  Motion& motion_;
  const Threads& threads_;
  std::vector<Range> ranges_;
  std::vector<std::size_t> first_;  // by part: of its ranges; then their number
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
