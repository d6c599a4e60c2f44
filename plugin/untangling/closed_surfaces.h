// Which bodies' surfaces are closed, and what is inside of them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "lazyccd/scene.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ClosedSurfaces {
 public:
  // Where the step begins. What the topology refers to and the motion must outlive it.
  ClosedSurfaces(const Topology& topology, const Motion& motion);

  // Each side of its faces is one of two faces.
  bool is_closed(std::int32_t body) const { return closed_[body] != 0; }
  // Of a closed surface.
  bool contains(std::int32_t body, const Eigen::Vector3d& point) const;

 private:
  Topology topology_;
  const Motion& motion_;
  std::vector<std::vector<std::int32_t>> faces_;  // by body
  std::vector<char> closed_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
