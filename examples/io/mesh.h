// A triangle mesh as it is read from a file.
#pragma once

#include <string>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::io {

struct Mesh {
  std::vector<std::array<double, 3>> vertices;
  std::vector<Face> faces;
};

/// Returns the mesh as one body. The mesh must outlive the result.
Topology topology(const Mesh& mesh);
/// Returns the positions of the vertices. The mesh must outlive the result.
Positions positions(const Mesh& mesh);

/// Checks that two meshes can be the two ends of one step: they need the same number of vertices
/// and the same faces. Otherwise throws Error(size_mismatch) that names the first difference.
void require_same_topology(const Mesh& start, const std::string& start_name, const Mesh& end,
                           const std::string& end_name);

}  // namespace lazyccd::io
