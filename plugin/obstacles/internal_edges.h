// Edges and vertices at which the surface of an obstacle hardly turns, as most of a terrain or of
// the side of a cylinder.
//
// What lies there is held by its own vertices: between them it sinks in by a small part of the gap
// that contacts keep. So contacts with these edges and vertices need no constraint. If one of them
// touches nevertheless, the re-check after the response finds it. Bodies that contacts move keep
// all of their contacts: what starts in a cloth comes out more calmly with them.
//
// The sag. A soft edge of length l crosses a surface that turns by the angle b below it. If both
// ends are at the distance d from the surface, all of the edge is at least about d - l b / 4 away.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/pair_surfaces.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"
#include "obstacles/obstacle_pairs.h"
#include "scene/step_topology.h"
#include "shapes/surface_bends.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class InternalEdges {
 public:
  /// The arguments must outlive it.
  InternalEdges(const StepTopology& topology, const Motion& motion, const PairSurfaces& surfaces)
      : topology_(topology), motion_(motion), surfaces_(surfaces) {}

  /// Measures the obstacles. Call when indices or pair rules change, with the start of a motion.
  /// `edges`: all edges, as Detector::edges(); `filters`: those of the detector, by body;
  /// `largest_thickness`: the largest thickness that is kept, metres.
  void set_topology(Span<const Edge> edges, Span<const Body> filters, double largest_thickness);
  /// What a detector may leave out, as Detector::leave_out(): the internal edges and vertices of
  /// obstacles that have hardly any others, as terrains. Empty if they are only a small part of the
  /// scene. It does not depend on single contacts, so what remove() would keep of them is left out
  /// too: contacts of edges with a pinned node, and what is pressed nearer than half of the
  /// thickness.
  Span<const char> edges_left_out() const { return edges_left_out_; }
  Span<const char> vertices_left_out() const { return vertices_left_out_; }

  /// Removes those of the contacts, which are sorted, that need no constraint. These are contacts
  /// with edges and vertices of obstacles, if a soft body sinks in between these by less than half
  /// of the thickness. So are those of a vertex with a face beyond such an edge. What starts nearer
  /// than half of the thickness is kept.
  void remove(std::vector<Contact>& contacts) const;

 private:
  // Finds what of an obstacle may be left out. Only the soft bodies that meet it count.
  void leave_out(const ObstaclePairs& obstacle, Span<const Edge> edges, double largest_thickness);
  /// Whether some contact of these bodies may need no constraint.
  bool may_need_none(std::int32_t body_a, std::int32_t body_b) const;
  bool needs_constraint(const Contact& contact, double thickness) const;
  // The first is about a contact of a soft edge or face with an edge or vertex of an obstacle. The
  // second is about one of a soft vertex with a face of an obstacle.
  bool is_internal(const Contact& contact, double thickness) const;
  bool is_beyond_edge(const Contact& contact, double thickness) const;
  // By which angle the surface turns below a soft edge of this length, metres. Radians.
  double turn_at_edge(std::size_t edge, double length) const;
  double turn_at_vertex(std::int32_t vertex, double length) const;
  double turn_around_ends(const Contact& contact, double length) const;
  bool is_movable(std::int32_t obstacle) const;
  double gap_at_start(const Contact& contact) const;  // between its points, metres
  double squared_length(std::int32_t a, std::int32_t b) const;

  const StepTopology& topology_;
  const Motion& motion_;
  const PairSurfaces& surfaces_;
  std::size_t first_edge_ = 0, first_face_ = 0;  // of an obstacle
  SurfaceBends bends_;                           // of all obstacles
  std::vector<char> edges_left_out_, vertices_left_out_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
