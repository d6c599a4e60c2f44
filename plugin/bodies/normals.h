// Normals of faces and nodes: btSoftBody::updateNormals() (Bullet 3.24) for all bodies, divided
// among threads by faces and nodes. The results are the same to the bit.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "util/parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Normals {
 public:
  /// Updates the normals of the active bodies.
  void update(const btAlignedObjectArray<btSoftBody*>& bodies, const ParallelFor& parallel_for);

 private:
  // The faces around each node of a body, in Bullet's order.
  struct Plan {
    const btSoftBody* body = nullptr;
    std::vector<std::int32_t> corners;     // by face: indices of its three nodes
    std::vector<std::int32_t> first_face;  // by node, and one more: first of its faces in `faces`
    std::vector<std::int32_t> faces;
    std::vector<btVector3> normals;  // by face, twice the area long
    bool fits(const btSoftBody& other) const;
  };

  // Returns false if a face has another body's node.
  static bool plan(const btSoftBody& body, Plan& plan);
  // Return false if a face differs from the plan.
  bool update_faces(const ParallelFor& parallel_for);
  static bool update_faces(btSoftBody& body, Plan& plan, std::size_t first, std::size_t last);
  void update_nodes(const ParallelFor& parallel_for);

  std::vector<Plan> plans_;
  std::vector<btSoftBody*> bodies_;  // the active ones
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
