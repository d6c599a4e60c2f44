// How a surface of triangles turns at its edges and vertices.
#pragma once

#include <LinearMath/btScalar.h>

#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// How the surface turns at its edges and vertices. An edge is sharp if it turns by more than 30
/// degrees, or does not have two faces with the same orientation.
struct SurfaceBends {
  /// By side of a face, 3 * face + k for the side from its corner k: the edge.
  std::vector<std::int32_t> edge_of_side;
  /// By edge: the angle between the normals of its faces, radians; infinite if the edge is sharp.
  std::vector<float> angles;
  /// By edge: this angle by the mean height of the faces over the edge, 1/metre. Infinite if the
  /// edge is sharp.
  std::vector<float> curvatures;
  /// By vertex, from the first one: twice the largest angle of a normal from the mean normal around
  /// the vertex, or between two sharp edges there, radians.
  std::vector<float> vertex_angles;
  /// By vertex: the largest curvature of its edges, 1/metre; infinite if one of them is sharp.
  std::vector<float> vertex_curvatures;
};

/// Measures the surface of `faces`. `edges`: their sides, each as (smaller, larger) vertex index,
/// sorted by the larger index, then the smaller. `positions`: three scalars per vertex of the
/// scene, metres. No face has a vertex before `first_vertex`.
SurfaceBends measure_bends(Span<const Face> faces, Span<const Edge> edges,
                           const std::vector<btScalar>& positions, std::int32_t first_vertex);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
