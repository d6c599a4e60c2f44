// The normals of a body's surface at the start of a step, turned to the side where others belong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "motion/motion.h"
#include "scene/step_topology.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Normals of faces, edges and vertices. Those of a solid point outwards: from a closed part of the
/// surface, or up from a plane or a terrain. The faces of a rigid room point inwards, and so do
/// its normals. Those of a sheet, which has two sides, agree with each other.
class OrientedSurface {
 public:
  /// Reads the faces of the body at the start of the step.
  OrientedSurface(const StepTopology& topology, const Motion& motion, std::int32_t body);

  /// A direction, and whether it tells inside from outside.
  struct Normal {
    Vector3d direction = Vector3d::Zero();  ///< unit length, or zero: there is none
    bool is_of_solid = false;
  };
  Normal of_face(std::int32_t face) const;
  /// Angle-weighted pseudonormals (Baerentzen and Aanaes 2005, "Signed distance computation using
  /// the angle weighted pseudonormal"): the sign of their product with the gap from the closest
  /// point tells inside from outside.
  Normal of_edge(std::int32_t a, std::int32_t b) const;
  Normal of_vertex(std::int32_t vertex) const;
  /// Indices of the faces around a vertex.
  Span<const std::int32_t> faces_around(std::int32_t vertex) const;

 private:
  struct OrientedFace {
    Face vertices;
    Vector3d normal;  // turned; zero if the face is degenerate
    bool is_of_solid;
  };
  void orient(const StepTopology& topology, const Motion& motion, std::int32_t body);
  const OrientedFace& face_of(std::int32_t face) const {
    return faces_[static_cast<std::size_t>(face - first_face_)];
  }

  std::int32_t first_face_, first_vertex_;
  std::vector<OrientedFace> faces_;
  std::vector<double> angles_;              // of each face, by corner
  std::vector<std::int32_t> first_around_;  // by vertex: where its faces begin in around_
  std::vector<std::int32_t> around_;        // indices of faces
};

/// Direction away from the inside of an obstacle without a closed surface: a plane or a terrain.
/// Zero for others.
Vector3d up_of(const StepTopology& topology, const Motion& motion, std::int32_t obstacle);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
