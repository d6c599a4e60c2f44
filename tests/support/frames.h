// The public frame pairs with the exact truth of their vertex-face and edge-edge pairs.
#pragma once

#include <array>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "io/mesh.h"
#include "lazyccd/contact.h"

namespace lazyccd::test {

// Vertices of a vertex-face or edge-edge pair in an order of its own: those of the face sorted;
// those of each edge sorted, the smaller edge first.
using PairKey = std::array<std::int32_t, 5>;  // kind first
PairKey key_of(ContactKind kind, std::array<std::int32_t, 4> vertices);
PairKey key_of(const Contact& contact);

struct FramePair {
  io::Mesh start, end;
  std::set<PairKey> colliding;  // all pairs that touch during the step, without a shared vertex
};

// All edges of the faces, (smaller, larger), sorted by the larger and then by the smaller.
std::vector<Edge> unique_edges(const std::vector<Face>& faces);

// Vertices of every pair that the ground truth lists, in its order; colliding or not.
std::vector<std::array<std::int32_t, 4>> read_listed_pairs(const std::filesystem::path& scene,
                                                           const io::Mesh& mesh, ContactKind kind);

// `scene` is a folder of data_dir() / "frames".
FramePair read_frame_pair(const std::filesystem::path& data, const std::string& scene);

}  // namespace lazyccd::test
