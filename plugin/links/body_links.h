// Solves the links of one soft body in groups (link_kernels.h), in place of
// btSoftBody::PSolve_Links().
#pragma once

#include <BulletSoftBody/btSoftBody.h>

#include <cstdint>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "links/link_batches.h"
#include "links/link_kernels.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class BodyLinks {
 public:
  /// Reads the links, constants and masses of the body, for `passes` calls of PSolve_Links().
  /// Returns false if a link has another body's node, or if Bullet itself is at least as fast; then
  /// call nothing else.
  bool prepare(const btSoftBody& body, std::int64_t passes);
  /// Copy node positions from the body (read) and back (write): of all nodes, or of one node by
  /// index.
  void read(const btSoftBody& body);
  void read(const btSoftBody& body, int node);
  void write(btSoftBody& body) const;
  void write(btSoftBody& body, int node) const;
  /// Same result as `passes` calls of PSolve_Links().
  void solve(int passes);

 private:
  void plan(const btSoftBody& body);
  bool is_planned(const btSoftBody& body) const;
  bool is_faster(std::int64_t passes) const;
  bool load_links(const btSoftBody& body);

  const LinkKernels* kernels_ = best_link_kernels();
  /// The body and its counts when plan_ was made.
  const btSoftBody* body_ = nullptr;
  int node_count_ = 0, link_count_ = 0;
  LinkEnds ends_;
  std::int64_t dependent_links_ = 0;  ///< links that depend on one of the few links before them

  LinkBatches plan_;
  std::vector<LinkGroup<btScalar>> groups_;  ///< empty: there is no plan
  std::vector<LinkedNode<btScalar>> nodes_;
  std::vector<btScalar> inverse_mass_;  ///< 1/kg, by node: close together, unlike Bullet's nodes
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
