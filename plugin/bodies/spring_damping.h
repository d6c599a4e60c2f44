// Damping of the springs of all bodies as a sparse symmetric matrix, in place of
// btDeformableMassSpringForce::addScaledDampingForceDifferential() (Bullet 3.24). A row belongs to
// a node, so rows can be multiplied on several threads. Bullet computes the directions of the
// springs again in each product; here they are computed once a step.
#pragma once

#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btSoftBody.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bodies/conjugate_residual.h"
#include "bodies/spring_constants.h"
#include "lazyccd/bullet/precision.h"
#include "util/parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SpringDamping {
 public:
  /// Reads the springs of the active bodies of a force. `nodes` is the number of nodes that the
  /// solver has; btSoftBody::Node::index is below it. Returns false if a spring has no direction or
  /// another node; then call nothing else.
  bool read(const btDeformableMassSpringForce& force, const SpringConstants& constants, int nodes,
            const ParallelFor& parallel_for);

  /// Adds row `node` of scale * D * x to `sum`, spring by spring in Bullet's order. -D is the
  /// damping matrix.
  void add_row(int node, btScalar scale, const VectorStack& x, btVector3& sum) const {
    if (constants_.along_spring) {
      add_row<true>(node, scale * constants_.damping, x, sum);
    } else {
      add_row<false>(node, scale * constants_.damping, x, sum);
    }
  }
  /// Subtracts the diagonal of scale times the damping matrix from `diagonal`.
  void subtract_diagonal(int node, btScalar scale, btVector3& diagonal) const;

 private:
  // One end of a spring, in the row of its node.
  struct End {
    btScalar direction[3];  // of the spring; length 1
    std::int32_t other;     // index of the node at the other end
  };
  struct Body {
    const btSoftBody* body;
    std::size_t first_spring, springs;
    bool operator==(const Body& b) const { return body == b.body && springs == b.springs; }
  };
  struct Spring {
    std::int32_t node[2];  // by end: index of the node
    std::size_t place[2];  // by end: in ends_
  };

  template <bool along_spring>
  void add_row(int node, btScalar factor, const VectorStack& x, btVector3& sum) const {
    const btVector3 own = x[node];
    const auto row = static_cast<std::size_t>(node);
    for (std::size_t i = first_end_[row]; i < first_end_[row + 1]; ++i) {
      const End& end = ends_[i];
      const btVector3 difference = x[end.other] - own;
      if constexpr (along_spring) {
        const btVector3 direction(end.direction[0], end.direction[1], end.direction[2]);
        sum += factor * difference.dot(direction) * direction;
      } else {
        sum += factor * difference;
      }
    }
  }
  bool plan(Span<const Body> bodies, int nodes);
  // Returns false if a spring differs from the plan, or has no direction.
  bool read_directions(const ParallelFor& parallel_for);
  bool read_direction(const btSoftBody::Link& link, const Spring& spring);

  SpringConstants constants_ = {};
  std::vector<Body> bodies_;
  std::vector<Spring> springs_;
  std::vector<std::size_t> first_end_;  // by node, and one more
  std::vector<End> ends_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
