// Finds the soft vertices that are inside of rigid bodies at the start of a step, and the way out.
// Edges that pass through faces (intersections.h) do not show how deep a body is, nor one that is
// inside as a whole.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <tuple>
#include <vector>

#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "motion/parts_inside.h"
#include "scene/step_topology.h"
#include "untangling/intersections.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A soft vertex inside of an obstacle.
struct InsideVertex {
  std::int32_t vertex, body;
  /// Metres: it is inside as long as it moves by less relative to the obstacle. 0: not known.
  double depth;

  bool operator<(const InsideVertex& other) const {
    return std::tie(vertex, body) < std::tie(other.vertex, other.body);
  }
};

/// The parts of soft bodies that are inside of obstacles. The lists of PartsInside hold the
/// vertices that are moved out, and all edges and faces that pass through.
struct Penetrations : PartsInside {
  /// A contact for each soft vertex inside of an obstacle (vertex_face), and for each soft edge
  /// that passes through one (edge_edge, at its deepest point). The normal shows the way out. The
  /// gap along the normal at the start of the step is minus the depth. Sorted.
  std::vector<Contact> contacts;
  std::vector<InsideVertex> inside;  ///< all vertices inside, also those that stay there; sorted
  /// What stays where it is in convex obstacles that nothing moves, because every way out is
  /// blocked or would stretch the soft body: see find_in_convex(). Edges and faces without its
  /// vertices.
  PartsInside trapped;
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

/// Finds the vertices inside of obstacles, sorted. `may_be_inside`: whether this pair of bodies is
/// looked at. `is_searched`: whether this vertex of it is.
std::vector<InsideVertex> find_inside(
    const StepTopology& topology, const Motion& motion,
    const std::function<bool(std::int32_t soft_body, std::int32_t obstacle)>& may_be_inside,
    const std::function<bool(std::int32_t vertex, std::int32_t obstacle)>& is_searched);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
