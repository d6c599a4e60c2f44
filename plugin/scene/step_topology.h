// Soft bodies and obstacles in the detector's one index space: the soft bodies first, then the
// obstacles that have triangles near them. Obstacles without, to which nodes of soft bodies are
// anchored, follow: the detector does not know of them.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/obstacles.h"
#include "scene/scene_topology.h"
#include "scene/soft_scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class StepTopology {
 public:
  struct BodyRecord {
    btCollisionObject* object;
    btSoftBody* soft;  // null for an obstacle
    int obstacle;      // index in Obstacles::records(), or -1
    bool dynamic;      // an obstacle that gives way
    std::int32_t first_vertex, vertex_count;
    double margin;  // metres
    bool responds;  // false: contacts are reported and nothing is moved
  };

  // True where the detector has to be told.
  bool update(const SoftScene& soft, const Obstacles& obstacles, bool parts_changed);
  Topology topology() const { return topology_.view(); }
  // The same, but the pinned nodes of a body that has others count as free: whoever moves them may
  // move them into each other, and a pair of which nothing is free is not reported.
  Topology for_detection() const;

  const std::vector<BodyRecord>& bodies() const { return bodies_; }
  std::int32_t vertex_count() const { return topology_.vertex_count(); }
  std::int32_t soft_count() const { return soft_count_; }  // of vertices
  std::int32_t body_of(std::int32_t vertex) const { return topology_.body_of_vertex[vertex]; }
  bool is_soft(std::int32_t vertex) const { return vertex < soft_count_; }
  // Metres: the largest sum of the margins of two bodies that may meet, or twice that of one that
  // meets itself.
  double largest_margins() const { return largest_margins_; }

 private:
  void read_bodies(const SoftScene& soft, const Obstacles& obstacles);
  void append(const Obstacles& obstacles);
  void free_pinned_nodes();
  std::vector<Body> filters(const SoftScene& soft, bool filtered_by_application) const;
  std::vector<BodyPair> disabled_pairs(const SoftScene& soft) const;
  void find_largest_margins(const SoftScene& soft);

  std::int32_t soft_count_ = 0;
  std::vector<BodyRecord> bodies_;
  std::size_t surface_count_ = 0;  // of those that the detector knows, the first ones
  SceneTopology topology_;
  double largest_margins_ = 0;
  std::vector<float> inverse_mass_for_detection_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
