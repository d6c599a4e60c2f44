// Culling of nodes on the CPU: a volume besides the boxes, normal cones, or both.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "cpu/node_culling.h"
#include "research/culling/normal_cones.h"
#include "research/volumes/node_volume.h"

namespace lazyccd::research {

class TreeCulling : public NodeCulling {
 public:
  /// `volumes` is null for Volume::box.
  TreeCulling(std::unique_ptr<NodeVolume> volumes, bool has_cones);

  void build(const Mesh& mesh, const Groups& groups, const Tree& tree) override;
  void refit(const Mesh& mesh, const Groups& groups, const Tree& tree,
             const std::vector<VertexRecord>& vertices, ThreadPool& pool) override;
  bool apart(std::uint32_t a, std::uint32_t b) const override;
  bool apart_from_itself(std::uint32_t node,
                         const std::vector<VertexRecord>& vertices) const override;
  std::size_t bytes() const override;

 private:
  std::unique_ptr<NodeVolume> volumes_;
  bool has_cones_;
  NormalCones cones_;
};

}  // namespace lazyccd::research
