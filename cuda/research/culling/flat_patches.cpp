#include "research/culling/flat_patches.h"

#include <algorithm>
#include <unordered_map>

namespace lazyccd::research {
namespace {

// Returns the boundary of some faces as one loop of vertices. Empty if the boundary is not one
// loop, or if the faces are not one oriented surface.
std::vector<std::int32_t> boundary_loop(const Mesh& mesh, const std::int32_t* faces,
                                        std::size_t count) {
  // By edge: number of faces, and the direction in which the first face runs along the edge.
  struct Side {
    std::int32_t from, to;
    int faces;
  };
  std::unordered_map<std::int32_t, Side> sides;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = mesh.faces()[faces[i]][k], to = mesh.faces()[faces[i]][(k + 1) % 3];
      Side& side =
          sides.try_emplace(mesh.face_edges()[faces[i]][k], Side{from, to, 0}).first->second;
      // Not oriented: a third face, or two faces that run along the edge in the same direction.
      if (side.faces == 2 || (side.faces == 1 && side.from == from)) return {};
      ++side.faces;
    }
  }
  std::unordered_map<std::int32_t, std::int32_t> next;
  for (const auto& [edge, side] : sides)
    if (side.faces == 1 && !next.emplace(side.from, side.to).second) return {};
  std::vector<std::int32_t> loop;
  if (next.empty()) return loop;
  const std::int32_t first = next.begin()->first;
  std::int32_t at_vertex = first;
  do {
    loop.push_back(at_vertex);
    at_vertex = next.at(at_vertex);
  } while (at_vertex != first && loop.size() <= next.size());
  if (loop.size() != next.size()) loop.clear();
  return loop;
}

}  // namespace

void Patches::build(const Mesh& mesh, const Groups& groups, const Tree& tree) {
  faces_.clear();
  first_face_.assign(1, 0);
  std::vector<char> useless;  // leaves without faces, or of a body without self-collision
  for (const std::int32_t g : tree.order()) {
    const Group& group = groups.groups()[g];
    const Block* block = groups.blocks().data() + group.first[kFaces];
    for (int i = 0; i < group.count[kFaces]; ++i)
      faces_.push_back(block[i / kBlockLanes].id[i % kBlockLanes]);
    first_face_.push_back(static_cast<std::uint32_t>(faces_.size()));
    useless.push_back(group.count[kFaces] == 0 || !mesh.bodies()[group.body].self_collision);
  }
  vertices_.clear();
  boundaries_.assign(tree.nodes().size(), {});
  for (std::size_t node = 0; node < boundaries_.size(); ++node) {
    const Tree::Range range = tree.ranges()[node];
    if (range.last - range.first > kLargest) continue;
    if (std::any_of(useless.begin() + range.first, useless.begin() + range.last,
                    [](char is) { return is != 0; }))
      continue;
    const std::uint32_t first = first_face_[range.first], last = first_face_[range.last];
    const auto loop = boundary_loop(mesh, faces_.data() + first, last - first);
    boundaries_[node] = {static_cast<std::uint32_t>(vertices_.size()),
                         static_cast<std::uint32_t>(loop.size())};
    vertices_.insert(vertices_.end(), loop.begin(), loop.end());
  }
}

}  // namespace lazyccd::research
