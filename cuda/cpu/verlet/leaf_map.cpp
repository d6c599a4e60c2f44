#include "cpu/verlet/leaf_map.h"

#include <algorithm>

namespace lazyccd {

namespace {

// The vertices of one group, each once.
class VertexSet {
 public:
  VertexSet() { std::fill_n(slots_, kSlots, -1); }
  // Returns whether the vertex is new.
  bool insert(std::int32_t v) {
    std::uint32_t at = static_cast<std::uint32_t>(v) * 0x9e3779b1u >> (32 - kBits);  // Knuth's hash
    while (slots_[at] >= 0 && slots_[at] != v) at = (at + 1) % kSlots;
    const bool is_new = slots_[at] < 0;
    slots_[at] = v;
    return is_new;
  }

 private:
  static constexpr int kBits = 7;
  static constexpr std::uint32_t kSlots = 1u << kBits;
  static_assert(kSlots >= 2 * 3 * kGroupCells, "half of the slots stay empty");
  std::int32_t slots_[kSlots];
};

}  // namespace

void LeafMap::build(const Mesh& mesh, const Groups& groups, const Tree& tree, ThreadPool& pool) {
  const NoinitVector<TreeNode>& nodes = tree.nodes();
  owner_[kVertices].assign(mesh.vertex_count(), 0);
  owner_[kEdges].assign(mesh.edges().size(), 0);
  owner_[kFaces].assign(mesh.faces().size(), 0);
  leaves_.clear();
  for (std::uint32_t node = 0; node < nodes.size(); ++node)
    if (nodes[node].leaf()) leaves_.push_back(node);
  first_.resize(leaves_.size() + 1);
  first_[0] = 0;

  constexpr std::size_t part = 128;  // leaves; first_ counts from the beginning of their part
  std::vector<std::vector<std::int32_t>> vertices((leaves_.size() + part - 1) / part);
  pool.parallel_for(vertices.size(), 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t p = begin; p < end; ++p)
      for (std::size_t i = p * part; i < std::min((p + 1) * part, leaves_.size()); ++i) {
        const Group& group = groups.groups()[nodes[leaves_[i]].group()];
        for (int kind = 0; kind < 3; ++kind) {
          const Block* block = groups.blocks().data() + group.first[kind];
          for (int k = 0; k < group.count[kind]; ++k)
            owner_[kind][block[k / kBlockLanes].id[k % kBlockLanes]] = leaves_[i];
        }
        VertexSet seen;
        for_each_vertex(groups, group, [&](std::int32_t v) {
          if (seen.insert(v)) vertices[p].push_back(v);
        });
        first_[i + 1] = static_cast<std::uint32_t>(vertices[p].size());
      }
  });
  vertices_.clear();
  for (std::size_t p = 0; p < vertices.size(); ++p) {
    const auto before = static_cast<std::uint32_t>(vertices_.size());
    for (std::size_t i = p * part; i < std::min((p + 1) * part, leaves_.size()); ++i)
      first_[i + 1] += before;
    vertices_.insert(vertices_.end(), vertices[p].begin(), vertices[p].end());
  }
}

NodePair LeafMap::owners_of(ContactKind kind, Candidate candidate) const {
  const bool vf = kind == ContactKind::vertex_face;
  const std::uint32_t a = owner_of(vf ? kVertices : kEdges, candidate.a),
                      b = owner_of(vf ? kFaces : kEdges, candidate.b);
  return {std::min(a, b), std::max(a, b)};
}

std::size_t LeafMap::bytes() const {
  std::size_t owners = 0;
  for (const std::vector<std::uint32_t>& owner : owner_) owners += owner.capacity();
  return (leaves_.capacity() + first_.capacity() + owners) * sizeof(std::uint32_t) +
         vertices_.capacity() * sizeof(std::int32_t);
}

}  // namespace lazyccd
