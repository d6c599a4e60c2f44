// One pass of Bullet's own continuous vertex-face detection between the two ends of a step.
// LazyCCD's whole detection is measured against it.
//
// The pass is one of the at most five iterations of
// btDeformableMultiBodyDynamicsWorld::performGeometricCollisions, without its response. It refits
// both trees to the swept boxes, computes the face normals that the filter needs, and calls
// btSoftBody::geometricCollisionHandler (vertex-face only; Bullet has no edge-edge test).
// Compiled once in each of Bullet's precisions, into separate programs, because the symbols of the
// two clash.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "lazyccd/scene.h"
#include "lazyccd/span.h"

namespace lazyccd::bench {

/// A mesh in Bullet.
class BulletCcd {
 public:
  /// Makes each connected component of the mesh a soft body, which collides with itself and the
  /// others.
  BulletCcd(const Positions& start, const Positions& end, Span<const Face> faces);
  ~BulletCcd();

  /// Runs one pass. Returns its wall time, milliseconds.
  double pass();

  /// Returns vertex and face of each contact of the last pass, sorted, each pair once. Bullet's own
  /// list has a pair once for each face of the vertex.
  std::vector<std::array<std::int32_t, 2>> contacts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lazyccd::bench
