// Finding of a mesh's edges and cells by a backend, in place of the host.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/bvh/cell.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// A topology, whose bodies were checked and whose faces and edges were not.
struct TopologyInput {
  Span<const Face> faces;
  Span<const Edge> edges;  // Topology::edges
  Span<const std::int32_t> body_of_vertex;
  std::size_t body_count;
  Span<const std::int32_t> world_of_body;  // empty: all bodies are in one world
};

/// What Mesh knows of a topology without its edges.
struct FoundTopology {
  bool is_valid = true;        // if false, nothing else is set: a face or edge is invalid
  std::size_t edge_count = 0;  // of EdgeTable::edges
  std::vector<CellSegment> segments;
};

/// Finds what EdgeTable and Cells find, to the bit, and keeps it.
class TopologyFinder {
 public:
  virtual ~TopologyFinder() = default;
  /// Throws Error(device) if it cannot.
  virtual FoundTopology find(const TopologyInput& input) = 0;
};

}  // namespace lazyccd
