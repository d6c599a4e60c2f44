// The closed parts of an obstacle's triangles that have an inside.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "motion/motion.h"
#include "scene/step_topology.h"
#include "util/box.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Faces that divide space into inside and outside. What the faces wind around once is inside. That
/// is one part whose faces point outwards, or several: a part whose faces point inwards is the wall
/// of a cavity in others. A part whose faces point inwards has no inside of its own: a room.
struct Solid {
  std::vector<std::int32_t> faces;  ///< ascending
  Box3d box;
  std::int32_t key;         ///< PartsOfObstacle::key_of() its first part
  bool is_single = true;    ///< one part
  bool is_oriented = true;  ///< faces that share a side are oriented alike
};

/// An obstacle's faces, divided into parts that share no vertex.
class PartsOfObstacle {
 public:
  PartsOfObstacle(const StepTopology& topology, std::int32_t obstacle);

  /// Tells the part of a vertex from other parts.
  std::int32_t key_of(std::int32_t vertex) const { return keys_[vertex - first_vertex_]; }
  /// Faces of each part by its key, ascending.
  const std::map<std::int32_t, std::vector<std::int32_t>>& faces() const { return faces_; }

 private:
  std::int32_t first_vertex_;
  std::vector<std::int32_t> keys_;  // by vertex of the obstacle
  std::map<std::int32_t, std::vector<std::int32_t>> faces_;
};

/// In the order of their first parts.
std::vector<Solid> find_solids(const PartsOfObstacle& parts, const Topology& topology,
                               const Motion& motion);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
