// A convex part of an obstacle and a soft body: what comes near, and whether nothing touches.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "lazyccd/contact.h"
#include "motion/closest_points.h"
#include "motion/motion.h"
#include "obstacles/moving_polyhedron.h"
#include "obstacles/soft_bounds.h"
#include "scene/step_topology.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ConvexPair {
 public:
  /// The arguments must outlive it; bodies are indices in the topology.
  ConvexPair(const StepTopology& topology, const Motion& motion, std::int32_t soft_body,
             std::int32_t obstacle);

  std::int32_t soft_body() const { return soft_body_; }
  /// Appends what comes within `separation` of the part in the motion, metres. `near`: what may.
  /// `thickness`: that of the pair. Call once in each motion, first. Returns false if a vertex of
  /// `near` starts inside of the part, or a position is not finite.
  bool find_near(const MovingPolyhedron& part, const NearPrimitives& near, double separation,
                 double thickness, std::vector<Contact>& contacts);
  /// True if it is certain that nothing of `near` touches the part in the motion to its present
  /// end, or, with `at_start`, at its start.
  bool is_clear(const MovingPolyhedron& part, const NearPrimitives& near, bool at_start);

 private:
  /// A vertex of the soft body.
  struct VertexRecord {
    std::int32_t side = 0;      // one that it is above; kept from one motion to the next
    double height = 0;          // above this side in all of the motion, metres
    bool is_held = false;       // it has a constraint with this side
    std::int32_t heights = -1;  // where they begin in heights_; negative: nowhere
  };
  struct NearEdge {
    Edge vertices;
    std::int32_t index;
  };
  struct RidgePoint {
    const ConvexPart::Ridge* ridge;
    ClosestOnSegments points;  // of the edge and the ridge
  };

  /// Starts with the present end of the motion, or its start. Sets the records: those that are not
  /// higher than `height` get the heights above all sides, and the highest side. Other functions
  /// know these vertices only. Returns false if a position is not finite.
  bool read_vertices(const MovingPolyhedron& part, const std::vector<std::int32_t>& vertices,
                     bool at_start, double height);
  Vector3d start_of(std::int32_t vertex) const { return motion_.start_of(vertex); }
  Vector3d end_of(std::int32_t vertex) const {
    return at_start_ ? motion_.start_of(vertex) : motion_.end_of(vertex);
  }
  VertexRecord& record_of(std::int32_t vertex) {
    return records_[static_cast<std::size_t>(vertex - soft().first_vertex)];
  }
  const StepTopology::BodyRecord& soft() const { return topology_.bodies()[soft_body_]; }
  const StepTopology::BodyRecord& obstacle() const { return topology_.bodies()[obstacle_]; }
  /// Writes the heights of a vertex, unless they are known.
  void find_heights(std::int32_t vertex);
  /// Those of find_heights(); until it is called for another vertex.
  VertexHeights heights_of(std::int32_t vertex);
  template <class Primitive>
  MovingPrimitive moving(const Primitive& primitive);
  /// True if an edge or a face is at least `height` above one side, or its vertices are held there.
  template <class Primitive>
  bool is_above_one_side(const Primitive& primitive, double height);
  /// Sets sides_, as is_above_one_side() with this height needs them.
  void note_sides(const std::vector<std::int32_t>& vertices, double height);
  void find_near_edges(const NearPrimitives& near, double separation, double held_height,
                       std::vector<Contact>& contacts);
  Vector3d position(std::int32_t vertex, double time) const {
    return (1 - time) * motion_.start_of(vertex) + time * motion_.end_of(vertex);
  }
  /// Normal of a side of the obstacle as it is turned at a time.
  Vector3d normal_at(std::int32_t side, double time) const;
  RidgePoint closest_ridge(const Edge& edge, const std::array<std::int32_t, 2>& sides,
                           double time) const;
  Contact vertex_contact(std::int32_t vertex, std::int32_t side, double time) const;
  void add_edge_contacts(const NearEdge& edge, double separation, std::vector<Contact>& contacts);
  Contact edge_contact(const NearEdge& edge, const SeparatingPlane& plane, const RidgePoint& at,
                       double time) const;
  Contact face_contact(std::int32_t face, const SeparatingPlane& plane, double time) const;

  const StepTopology& topology_;
  const Motion& motion_;
  std::int32_t soft_body_, obstacle_;
  bool at_start_ = false;
  const MovingPolyhedron* part_ = nullptr;
  std::vector<VertexRecord> records_;
  // By vertex: the side of its record if it is high enough above it; -1: it is not.
  std::vector<std::int32_t> sides_;
  // Scratch memory.
  std::vector<double> heights_;  // of a vertex: at the start, then at the end, by side
  std::vector<NearEdge> edges_;  // that need a constraint
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
