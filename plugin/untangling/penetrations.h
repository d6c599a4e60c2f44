// Finds the soft vertices that are inside of rigid bodies at the start of a step, and the way out.
// Edges that pass through faces (intersections.h) do not show how deep a body is, nor one that is
// inside as a whole.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "scene/step_topology.h"
#include "untangling/intersections.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The parts of soft bodies that are inside of obstacles.
struct Penetrations {
  /// A contact for each soft vertex inside of an obstacle (vertex_face), and for each soft edge
  /// that passes through one (edge_edge, at its deepest point). The normal shows the way out. The
  /// gap along the normal at the start of the step is minus the depth. Sorted.
  std::vector<Contact> contacts;
  // These are inside of the obstacle of the given body, or pass through its surface. Sorted.
  std::vector<std::array<std::int32_t, 2>> vertices;  ///< vertex, body
  std::vector<std::array<std::int32_t, 3>> edges;     ///< two vertices, the smaller first; body
  std::vector<std::array<std::int32_t, 4>> faces;     ///< three vertices, ascending; body

  /// True if these are vertices of one primitive of the soft body that is inside or passes through.
  /// `soft`: one vertex, or the two of an edge, or the three of a face.
  bool contains(Span<const std::int32_t> soft, std::int32_t body) const;
};

/// Finds the penetrations at the start of a step. These obstacles have an inside: planes and
/// terrains (below them), and the solids of a body whose triangles are closed (solids.h). What
/// hangs together inside of a plane or a convex solid leaves it through the same face: mostly the
/// one through which the way is shortest, see find_in_convex(). From terrains and other solids each
/// vertex leaves through the nearest face, and edges do not count. `may_penetrate`: whether this
/// pair of bodies is looked at. `is_anchored`: an anchor holds the vertex to this body; it is left
/// out.
Penetrations find_penetrations(
    const StepTopology& topology, const Intersections& intersections, Span<const Edge> edges,
    const Motion& motion,
    const std::function<bool(std::int32_t soft_body, std::int32_t obstacle)>& may_penetrate,
    const std::function<bool(std::int32_t vertex, std::int32_t body)>& is_anchored);

/// Finds the vertices that nothing moves inside of obstacles that nothing moves: vertex and body,
/// sorted. `may_be_inside`: whether this pair of bodies is looked at.
std::vector<std::array<std::int32_t, 2>> find_pinned_inside(
    const StepTopology& topology, const Motion& motion,
    const std::function<bool(std::int32_t soft_body, std::int32_t obstacle)>& may_be_inside);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
