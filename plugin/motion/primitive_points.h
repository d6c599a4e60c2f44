// The points of a vertex, an edge or a face.
#pragma once

#include <array>
#include <cstddef>

#include "lazyccd/bullet/precision.h"
#include "motion/motion.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// A vertex, an edge or a face at one time: the positions of its first `count` vertices, metres.
struct PrimitivePoints {
  std::array<Vector3d, 3> x;
  int count;
};

/// An edge or a face of the topology at the start of a motion, or at its end.
template <class Primitive>
PrimitivePoints points_of(const Primitive& primitive, const Motion& motion, bool at_start) {
  PrimitivePoints points{{}, static_cast<int>(primitive.size())};
  for (std::size_t i = 0; i < primitive.size(); ++i)
    points.x[i] = at_start ? motion.start_of(primitive[i]) : motion.end_of(primitive[i]);
  return points;
}

/// The primitive at time t between its start and its end.
inline PrimitivePoints between(const PrimitivePoints& start, const PrimitivePoints& end, double t) {
  PrimitivePoints points{{}, start.count};
  for (int i = 0; i < start.count; ++i) points.x[i] = (1 - t) * start.x[i] + t * end.x[i];
  return points;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
