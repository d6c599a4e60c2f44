// Bounds of soft bodies over a motion, in blocks of neighbours. Most of a large body is far from a
// small obstacle.
#pragma once

#include <cstdint>
#include <vector>

#include "motion/motion.h"
#include "motion/motion_bounds.h"
#include "scene/step_topology.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Edges and faces of a soft body and all of their vertices: indices in the topology, each once.
/// The vertices are sorted.
struct NearPrimitives {
  std::vector<std::int32_t> vertices, edges, faces;

  bool empty() const { return edges.empty() && faces.empty(); }
};

/// Finds what of the soft bodies may be near something. What it finds does not depend on the
/// blocks.
class SoftBounds {
 public:
  /// The arguments must outlive it.
  SoftBounds(const StepTopology& topology, const Motion& motion)
      : topology_(topology), motion_(motion) {}

  /// Call when indices change.
  void set_topology() { bodies_.assign(topology_.bodies().size(), {}); }
  /// Begins a motion, or its present end, which may be another one. `at_start`: nothing moves.
  void begin(bool at_start);
  /// Returns the edges and faces of a soft body whose own bounds come within `distance` of others,
  /// metres. What is not finite always counts. Valid until the next call.
  const NearPrimitives& find_near(std::int32_t soft_body, const MotionBounds& other,
                                  double distance);

 private:
  /// Neighbours: ranges in the lists of their body.
  struct Block {
    IndexRange primitives, vertices;
    MotionBounds bounds;
  };
  /// The edges or the faces of a body.
  struct Blocks {
    std::vector<std::int32_t> primitives, vertices;  // a vertex is once in each of its blocks
    std::vector<Block> blocks;
  };
  struct BodyBounds {
    bool has_blocks = false, is_current = false;
    MotionBounds all;
    Blocks edges, faces;
    std::vector<std::uint8_t> marks;  // by vertex, scratch memory; 0 between calls
  };
  /// The bounds with which a body is compared.
  struct Other {
    const MotionBounds& bounds;
    double distance;
  };

  template <class Primitives>
  void make_blocks(const Primitives& primitives, const IndexRange& range, Blocks& result) const;
  void update(const StepTopology::BodyRecord& soft, BodyBounds& body) const;
  // is_finite: the vertex is known to be finite; otherwise that is tested.
  std::uint8_t beyond(std::int32_t vertex, const Other& other, bool is_finite) const;
  template <class Primitives>
  void add_near(const Primitives& primitives, const Blocks& all, const Other& other,
                std::int32_t first_vertex, std::vector<std::uint8_t>& marks,
                std::vector<std::int32_t>& near);

  const StepTopology& topology_;
  const Motion& motion_;
  bool at_start_ = false;
  std::vector<BodyBounds> bodies_;  // filled as far as they are needed
  NearPrimitives near_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
