// The bounding volume hierarchy of a mesh in motion.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "core/bvh/node_pair.h"
#include "cpu/node_culling.h"
#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "host/scene/vertex_record.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/algorithm.h"

namespace lazyccd {

/// Groups of primitives, the tree above them, and the optional culling of its nodes.
class Hierarchy {
 public:
  /// The boxes are wider than the primitives by `margin` until update() sets another one. Without
  /// `culling`, nodes have boxes only.
  Hierarchy(const AlgorithmOptions& options, double margin, const LeafKernels& kernels,
            std::unique_ptr<NodeCulling> culling);

  /// Makes the next update() build everything anew.
  void forget() { is_built_ = false; }
  bool is_built() const { return is_built_; }
  /// Fits everything to the positions of this step. Builds the tree anew if it was forgotten, if
  /// its boxes have grown too much (AlgorithmOptions::rebuild_ratio), or if the options ask for it
  /// in every step. Returns whether it did. `margin` is in the unit of the positions.
  bool update(const Mesh& mesh, const std::vector<VertexRecord>& records, double scale,
              double margin, ThreadPool& pool);

  /// Fits everything to other positions, without a new build.
  void refit(const std::vector<VertexRecord>& records, double scale, double margin,
             ThreadPool& pool);

  /// Call when the mesh has other resting bodies (Mesh::rests()).
  void update_resting(ThreadPool& pool) {
    if (is_built_) find_node_info(pool);
  }

  const Groups& groups() const { return groups_; }
  const Tree& tree() const { return tree_; }
  const NodeCulling* culling() const { return culling_.get(); }  ///< null: boxes only
  /// Whether the collision filters and pins allow contacts between two nodes, at any positions.
  bool may_collide(NodePair pair) const {
    const NodeInfo &a = node_info_[pair.a], &b = node_info_[pair.b];
    return !(a.pinned && b.pinned) && (a.body < 0 || b.body < 0 || mesh_->collide(a.body, b.body));
  }
  /// Lower bound of the limits (Topology::self_separation) of all pairs of primitives of one body,
  /// one below each node. Infinite if no such pair may collide.
  float least_self_separation(NodePair pair) const {
    const NodeInfo &a = node_info_[pair.a], &b = node_info_[pair.b];
    if (a.body >= 0 && b.body >= 0 && a.body != b.body)
      return std::numeric_limits<float>::infinity();
    return std::min(a.least_self_separation, b.least_self_separation);
  }
  /// Whether all bodies below both nodes rest.
  bool both_rest(NodePair pair) const {
    return node_info_[pair.a].rests && node_info_[pair.b].rests;
  }
  std::size_t bytes() const;

 private:
  // Summary of everything below a node of the tree.
  struct NodeInfo {
    std::int32_t body;  // the body of all primitives; -1: several bodies
    bool pinned;        // whether all vertices are pinned
    bool rests;         // whether all bodies rest
    // Of the vertices of all bodies that collide with themselves; infinite if there is none.
    float least_self_separation;
  };

  void find_node_info(ThreadPool& pool);
  void refit_boxes(const std::vector<VertexRecord>& records, double scale, double margin,
                   ThreadPool& pool);
  void refit_culling(const std::vector<VertexRecord>& records, ThreadPool& pool);

  AlgorithmOptions options_;
  const Mesh* mesh_ = nullptr;
  bool is_built_ = false;
  double built_cost_ = 0;  // cost of the tree when it was built
  Groups groups_;
  Tree tree_;
  NoinitVector<NodeInfo> node_info_;  // by node
  std::unique_ptr<NodeCulling> culling_;
};

}  // namespace lazyccd
