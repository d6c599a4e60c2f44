// Solves the links of one soft body, or of several that do not move each other's nodes, in groups
// (link_kernels.h), in place of btSoftBody::PSolve_Links(). Links of different bodies do not wait
// for each other, so many small bodies fill the groups as a large one does.
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"
#include "links/link_batches.h"
#include "links/link_kernels.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class BodyLinks {
 public:
  /// Reads the links, constants and masses of the bodies, for `passes` calls of PSolve_Links() with
  /// each. Returns false if a link has a node that is not of its body, or if Bullet itself is at
  /// least as fast; then call nothing else. The bodies must stay until the last call.
  bool prepare(Span<btSoftBody* const> bodies, std::int64_t passes);
  /// Copy all node positions from the bodies and back.
  void read();
  void write() const;
  /// Copy the position of a node of the first body, by index.
  void read(int node);
  void write(int node) const;
  /// Same result as `passes` calls of PSolve_Links() with each body.
  void solve(int passes);
  /// The same for the first body alone, with other positions: by node, metres.
  void solve(int passes, Span<btVector3> positions);

 private:
  /// A body and its counts when plan_ was made.
  struct Member {
    btSoftBody* body;
    int node_count, link_count;
    std::int32_t first_node;  ///< in nodes_
  };

  void plan(Span<btSoftBody* const> bodies);
  bool is_planned(Span<btSoftBody* const> bodies) const;
  bool is_faster(std::int64_t passes) const;
  bool load_links();

  const LinkKernels* kernels_ = best_link_kernels();
  std::vector<Member> members_;  ///< empty: there is no plan
  LinkEnds ends_;                ///< of all bodies, as indices in nodes_
  std::int32_t node_count_ = 0;
  std::int64_t dependent_links_ = 0;  ///< links that depend on one of the few links before them

  LinkBatches plan_;
  std::vector<LinkGroup<btScalar>> groups_;  ///< empty: nothing can be solved here
  std::vector<LinkedNode<btScalar>> nodes_;
  std::vector<btScalar> inverse_mass_;  ///< 1/kg, by node: close together, unlike Bullet's nodes
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
