// A triangle mesh as files hold it.
#pragma once

#include <string>
#include <vector>

#include "lazyccd/scene.h"

namespace lazyccd::io {

struct Mesh {
  std::vector<std::array<double, 3>> vertices;
  std::vector<Face> faces;
};

// All of it as one body. The mesh must outlive the result.
Topology topology(const Mesh& mesh);
Positions positions(const Mesh& mesh);

// Two meshes are two ends of one step only where their faces are the same. Throws Error naming the
// first difference.
void require_same_topology(const Mesh& start, const std::string& start_name, const Mesh& end,
                           const std::string& end_name);

}  // namespace lazyccd::io
