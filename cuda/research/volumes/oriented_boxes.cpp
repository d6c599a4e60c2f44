#include "research/volumes/oriented_boxes.h"

namespace lazyccd::research {

void OrientedBoxes::fit_leaf(const Groups& groups, const Group& group,
                             const std::vector<VertexRecord>& vertices, std::size_t node) {
  Moments& m = moments_[node];
  m = {};
  for_each_vertex(groups, group, [&](std::int32_t v) {
    m.add(vertices[v].x);
    m.add(vertices[v].x + 3);
  });
  double axis[3][3];
  principal_axes(m, axis);
  AxesExtent extent;
  for_each_vertex(groups, group, [&](std::int32_t v) {
    extent.add(axis, vertices[v].x);
    extent.add(axis, vertices[v].x + 3);
  });
  boxes_[node] = enclose(axis, extent, margin_);
}

void OrientedBoxes::fit_parent(const TreeNode& node, std::size_t index) {
  Moments& m = moments_[index];
  m = moments_[node.left];
  m.add(moments_[node.right()]);
  double axis[3][3];
  principal_axes(m, axis);
  AxesExtent extent;
  extent.add(axis, boxes_[node.left]);
  extent.add(axis, boxes_[node.right()]);
  boxes_[index] = enclose(axis, extent, 0);  // the boxes of the children have the margin
}

void OrientedBoxes::refit(const Groups& groups, const Tree& tree,
                          const std::vector<VertexRecord>& vertices, ThreadPool& pool) {
  moments_.resize(tree.nodes().size());
  boxes_.resize(tree.nodes().size());
  tree.for_each_upward(pool, [&](std::size_t i) {
    const TreeNode& node = tree.nodes()[i];
    if (node.leaf()) {
      fit_leaf(groups, groups.groups()[node.group()], vertices, i);
    } else {
      fit_parent(node, i);
    }
  });
}

bool OrientedBoxes::apart(std::uint32_t a, std::uint32_t b) const {
  return research::apart(boxes_[a], boxes_[b]);
}

std::size_t OrientedBoxes::bytes() const {
  return moments_.capacity() * sizeof(Moments) + boxes_.capacity() * sizeof(OrientedBox);
}

}  // namespace lazyccd::research
