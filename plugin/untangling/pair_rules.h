// Which pairs of bodies collide and respond.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <set>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Tells which bodies collide, by groups, layers, disabled pairs and contact response. The
/// constructor arguments must outlive it.
class PairRules {
 public:
  PairRules(const Topology& topology, const std::function<bool(std::int32_t body)>& responds)
      : topology_(topology), responds_(responds) {
    for (const BodyPair& pair : topology.disabled_pairs)
      disabled_.insert({std::min(pair[0], pair[1]), std::max(pair[0], pair[1])});
  }
  bool collide(std::int32_t a, std::int32_t b) const {
    if (!responds_(a) || !responds_(b)) return false;
    if (a == b) return topology_.bodies[a].self_collision;
    return filters_accept(topology_.bodies[a], topology_.bodies[b]) &&
           !disabled_.count({std::min(a, b), std::max(a, b)});
  }

 private:
  const Topology& topology_;
  const std::function<bool(std::int32_t)>& responds_;
  std::set<BodyPair> disabled_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
