// Reads the public frame pairs and the exact truth of their vertex-face and edge-edge pairs.
#pragma once

#include <array>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "io/mesh.h"
#include "lazyccd/contact.h"

namespace lazyccd::test {

/// The kind, then the vertices of a vertex-face or edge-edge pair in a canonical order: the
/// vertices of the face sorted; the vertices of each edge sorted, and the smaller edge first.
using PairKey = std::array<std::int32_t, 5>;
PairKey key_of(ContactKind kind, std::array<std::int32_t, 4> vertices);
PairKey key_of(const Contact& contact);

/// Two consecutive frames of a mesh.
struct FramePair {
  io::Mesh start, end;
  std::set<PairKey> colliding;  ///< all pairs without a shared vertex that touch in the step
};

/// All edges of the faces as (smaller, larger), sorted by the larger and then by the smaller
/// vertex.
std::vector<Edge> unique_edges(const std::vector<Face>& faces);

/// Vertices of every pair that the ground truth lists, in the file's order; colliding or not.
std::vector<std::array<std::int32_t, 4>> read_listed_pairs(const std::filesystem::path& scene,
                                                           const io::Mesh& mesh, ContactKind kind);

/// `scene` is the name of a folder in data_dir() / "frames".
FramePair read_frame_pair(const std::filesystem::path& data, const std::string& scene);

}  // namespace lazyccd::test
