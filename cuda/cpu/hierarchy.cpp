#include "cpu/hierarchy.h"

#include <utility>

#include "lazyccd/debug/assert.h"

namespace lazyccd {
namespace {

// Whether the groups own as many primitives as the mesh has, but for those that are left out.
bool own_all(const Groups& groups, const Mesh& mesh) {
  std::size_t owned[3] = {};
  for (const Group& group : groups.groups())
    for (int kind = 0; kind < 3; ++kind) owned[kind] += static_cast<std::size_t>(group.count[kind]);
  return owned[kFaces] == mesh.faces().size() &&
         (mesh.leaves_out_any() || owned[kEdges] == mesh.edge_count());
}

// Whether the leaves of the tree are the groups, each once.
bool are_leaves(const Groups& groups, const Tree& tree) {
  std::vector<char> is_leaf(groups.groups().size(), 0);
  std::size_t leaves = 0;
  for (const TreeNode& node : tree.nodes()) {
    if (!node.leaf()) continue;
    const auto group = static_cast<std::size_t>(node.group());
    if (group >= is_leaf.size() || is_leaf[group]++ != 0) return false;
    ++leaves;
  }
  return leaves == is_leaf.size();
}

}  // namespace

Hierarchy::Hierarchy(const AlgorithmOptions& options, double margin, const LeafKernels& kernels,
                     std::unique_ptr<NodeCulling> culling)
    : options_(options), groups_(margin, kernels), culling_(std::move(culling)) {}

bool Hierarchy::update(const Mesh& mesh, const std::vector<VertexRecord>& records, double scale,
                       double margin, ThreadPool& pool) {
  mesh_ = &mesh;
  bool build = !is_built_ || options_.rebuild_every_step;
  if (!build) {
    refit_boxes(records, scale, margin, pool);
    build = tree_.cost() > options_.rebuild_ratio * built_cost_;
  }
  if (build) {
    groups_.set_margin(margin);
    groups_.build(mesh, records, pool, scale);
    LAZYCCD_ASSERT(own_all(groups_, mesh), "each face and edge is in one group");
    tree_.build(groups_.codes(), groups_.boxes(), pool, groups_.worlds());
    LAZYCCD_ASSERT(are_leaves(groups_, tree_), "each group is one leaf of the tree");
    built_cost_ = tree_.cost();
    is_built_ = true;
    find_node_info(pool);
    if (culling_) culling_->build(mesh, groups_, tree_);
  }
  refit_culling(records, pool);
  return build;
}

void Hierarchy::refit(const std::vector<VertexRecord>& records, double scale, double margin,
                      ThreadPool& pool) {
  refit_boxes(records, scale, margin, pool);
  refit_culling(records, pool);
}

void Hierarchy::refit_boxes(const std::vector<VertexRecord>& records, double scale, double margin,
                            ThreadPool& pool) {
  groups_.set_margin(margin);
  groups_.refit(records, pool, scale);
  tree_.refit(groups_.boxes(), pool);
}

void Hierarchy::refit_culling(const std::vector<VertexRecord>& records, ThreadPool& pool) {
  if (culling_) culling_->refit(*mesh_, groups_, tree_, records, pool);
}

void Hierarchy::find_node_info(ThreadPool& pool) {
  const NoinitVector<TreeNode>& nodes = tree_.nodes();
  node_info_.resize(nodes.size());
  tree_.for_each_upward(pool, [&](std::size_t i) {
    if (nodes[i].leaf()) {
      const Group& group = groups_.groups()[nodes[i].group()];
      node_info_[i] = {group.body, group.pinned != 0, mesh_->rests(group.body),
                       mesh_->collide(group.body, group.body)
                           ? group.least_self_separation
                           : std::numeric_limits<float>::infinity()};
    } else {
      const NodeInfo &left = node_info_[nodes[i].left], &right = node_info_[nodes[i].right()];
      node_info_[i] = {left.body == right.body ? left.body : -1, left.pinned && right.pinned,
                       left.rests && right.rests,
                       std::min(left.least_self_separation, right.least_self_separation)};
    }
  });
}

std::size_t Hierarchy::bytes() const {
  return groups_.bytes() + tree_.bytes() + node_info_.capacity() * sizeof(NodeInfo) +
         (culling_ ? culling_->bytes() : 0);
}

}  // namespace lazyccd
