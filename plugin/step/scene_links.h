// The links of soft bodies, between vertices of the scene.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"
#include "response/links/link_rounds.h"
#include "scene/soft_scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Reads the links of a body when they are first asked for, once a step.
class SceneLinks {
 public:
  /// Call in each step, and when bodies have got other indices.
  void clear() { is_read_.clear(); }
  /// As LinkSolver::links.
  Span<const LinkSolver::Link> of(const SoftScene& scene, std::int32_t body);

 private:
  std::vector<std::vector<LinkSolver::Link>> links_;  // by body
  std::vector<char> is_read_;                         // by body
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
