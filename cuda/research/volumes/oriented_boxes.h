// Oriented boxes of the nodes, along the principal axes of the vertices below (Gottschalk et al.
// 1996). The axes and the boxes cover the positions at both ends of the step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "research/volumes/node_volume.h"
#include "research/volumes/oriented_box.h"

namespace lazyccd::research {

/// Oriented boxes of every node, over the whole step.
class OrientedBoxes : public NodeVolume {
 public:
  explicit OrientedBoxes(double margin) : margin_(margin) {}

  void refit(const Groups& groups, const Tree& tree, const std::vector<VertexRecord>& vertices,
             ThreadPool& pool) override;
  bool apart(std::uint32_t a, std::uint32_t b) const override;
  std::size_t bytes() const override;

 private:
  void fit_leaf(const Groups& groups, const Group& group, const std::vector<VertexRecord>& vertices,
                std::size_t node);
  void fit_parent(const TreeNode& node, std::size_t index);

  double margin_;
  std::vector<Moments> moments_;  // of the positions below each node
  std::vector<OrientedBox> boxes_;
};

}  // namespace lazyccd::research
