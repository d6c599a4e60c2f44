// The links of one soft body of Bullet, solved in groups (links.h) in place of
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
  // For so many calls of PSolve_Links(): the body's links, constants and masses as they are now.
  // False where a link has another body's node, or where Bullet itself takes no longer: then
  // nothing else may be called.
  bool take(const btSoftBody& body, std::int64_t passes);
  // From the body, positions of nodes, and back: of all, or of one by its index.
  void read(const btSoftBody& body);
  void read(const btSoftBody& body, int node);
  void write(btSoftBody& body) const;
  void write(btSoftBody& body, int node) const;
  // As that many calls.
  void solve(int passes);

 private:
  void plan(const btSoftBody& body);
  bool is_planned(const btSoftBody& body) const;
  bool pays(std::int64_t passes) const;
  bool take_links(const btSoftBody& body);

  const LinkKernels* kernels_ = best_link_kernels();
  // What was planned for.
  const btSoftBody* body_ = nullptr;
  int node_count_ = 0, link_count_ = 0;
  LinkEnds ends_;
  std::int64_t waiting_ = 0;  // links that wait for one just before them

  LinkBatches plan_;
  std::vector<LinkGroup<btScalar>> groups_;  // none: there is no plan
  std::vector<LinkedNode<btScalar>> nodes_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
