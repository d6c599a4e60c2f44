// One pass of Bullet's own continuous vertex-face detection on the two ends of a step: the anchor
// that LazyCCD's whole detection is measured against.
//
// The pass is one of the up to five iterations of
// btDeformableMultiBodyDynamicsWorld::performGeometricCollisions without its response: refit of
// both trees to the swept boxes, the face normals that the filter needs, then
// btSoftBody::geometricCollisionHandler (vertex against face; Bullet has no edge against edge).
// Compiled once in each of Bullet's precisions, into separate programs, because their symbols
// clash.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "lazyccd/scene.h"
#include "lazyccd/span.h"

namespace lazyccd::bench {

class BulletCcd {
 public:
  // Each connected component of the mesh becomes a soft body that collides with itself and the
  // others.
  BulletCcd(const Positions& start, const Positions& end, Span<const Face> faces);
  ~BulletCcd();

  // Wall time of one pass, milliseconds.
  double pass();

  // Vertex and face of the last pass's contacts, each pair once, sorted. Bullet's own list holds a
  // pair once for each face that the vertex belongs to.
  std::vector<std::array<std::int32_t, 2>> contacts() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lazyccd::bench
