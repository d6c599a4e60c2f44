// Soft bodies and obstacles in one index space, as the detector needs it.
//
// The order of bodies is: soft bodies; obstacles that have triangles near them; obstacles without
// triangles to which nodes are anchored. The detector does not know the last group.
#pragma once

#include <cstdint>
#include <memory>
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
    btSoftBody* soft;  ///< null for an obstacle
    int obstacle;      ///< index in Obstacles::records(), or -1
    bool dynamic;      ///< an obstacle that contacts can move
    std::int32_t first_vertex, vertex_count;
    double margin;  ///< metres; of an obstacle: margin_of_triangles()
    /// False for a soft body with CF_NO_CONTACT_RESPONSE: its contacts are reported, but nothing is
    /// moved. Always true for an obstacle: a rigid body with this flag is none.
    bool responds;
    IndexRange faces, edges;                     ///< in topology()
    std::shared_ptr<const Triangles> triangles;  ///< of an obstacle
  };

  /// Reads the bodies if `scene_changed`, and the application's filter if there is one. Returns
  /// true if topology() changed, so that the detector needs it again.
  bool update(const SoftScene& soft, const Obstacles& obstacles, bool scene_changed);
  Topology topology() const { return topology_.view(); }
  /// Like topology(), but pinned nodes count as free in a soft body that also has free nodes.
  /// Reason: the application may move pinned nodes into each other, and the detector does not
  /// report pairs without a free vertex.
  Topology for_detection() const;

  const std::vector<BodyRecord>& bodies() const { return bodies_; }
  std::int32_t index_of(const BodyRecord& body) const {
    return static_cast<std::int32_t>(&body - bodies_.data());
  }
  /// An id for each body, which stays the same as long as the body exists: that of its broad phase
  /// proxy. A soft body without a proxy has a negative one, by its index.
  std::vector<int> ids() const;
  std::int32_t vertex_count() const { return topology_.vertex_count(); }
  std::int32_t soft_count() const { return soft_count_; }  ///< of vertices
  std::int32_t body_of(std::int32_t vertex) const { return topology_.body_of_vertex[vertex]; }
  bool is_soft(std::int32_t vertex) const { return vertex < soft_count_; }
  /// Largest sum of the margins of two bodies that may collide, metres. For a body that collides
  /// with itself: twice its margin.
  double largest_margins() const { return largest_margins_; }

 private:
  void read_bodies(const SoftScene& soft, const Obstacles& obstacles);
  void append_obstacles(const Obstacles& obstacles);
  void free_pinned_nodes();
  std::vector<Body> filters(const SoftScene& soft, bool filtered_by_application) const;
  std::vector<BodyPair> disabled_pairs(const SoftScene& soft) const;
  void find_largest_margins(const SoftScene& soft);

  bool filtered_by_application_ = false;  // in the last update
  std::int32_t soft_count_ = 0;
  std::vector<BodyRecord> bodies_;
  std::size_t surface_count_ = 0;  // bodies that the detector knows; they come first
  SceneTopology topology_;
  double largest_margins_ = 0;
  std::vector<float> inverse_mass_for_detection_;
};

/// Contacts number the sides of soft faces and the soft edges after those that a detector may have:
/// side k of face f is first_side_index() + 3 f + k, edge e is first_edge_index() + e.
std::int32_t first_side_index(const Topology& topology);
std::int32_t first_edge_index(const Topology& topology);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
