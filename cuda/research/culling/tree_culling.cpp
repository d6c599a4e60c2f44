#include "research/culling/tree_culling.h"

#include <utility>

namespace lazyccd::research {

TreeCulling::TreeCulling(std::unique_ptr<NodeVolume> volumes, bool has_cones)
    : volumes_(std::move(volumes)), has_cones_(has_cones) {}

void TreeCulling::build(const Mesh& mesh, const Groups& groups, const Tree& tree) {
  if (has_cones_) cones_.build(mesh, groups, tree);
}

void TreeCulling::refit(const Mesh& mesh, const Groups& groups, const Tree& tree,
                        const std::vector<VertexRecord>& vertices, ThreadPool& pool) {
  if (volumes_) volumes_->refit(groups, tree, vertices, pool);
  if (has_cones_) cones_.refit(mesh, tree, vertices, pool);
}

bool TreeCulling::apart(std::uint32_t a, std::uint32_t b) const {
  return volumes_ && volumes_->apart(a, b);
}

bool TreeCulling::apart_from_itself(std::uint32_t node,
                                    const std::vector<VertexRecord>& vertices) const {
  return has_cones_ && cones_.apart_from_itself(node, vertices);
}

std::size_t TreeCulling::bytes() const {
  return cones_.bytes() + (volumes_ ? volumes_->bytes() : 0);
}

}  // namespace lazyccd::research
