// The order of the cells from which the groups are cut.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/bvh/morton.h"
#include "host/scene/mesh.h"
#include "host/scene/vertex_record.h"
#include "host/threads/key_sort.h"
#include "host/threads/thread_pool.h"

namespace lazyccd {

/// The cells of each segment of a mesh (host/scene/cells.h), in Morton order of their centroids at
/// the start.
class CellOrder {
 public:
  void build(const Mesh& mesh, const std::vector<VertexRecord>& vertices, ThreadPool& pool);

  std::size_t size() const { return sort_.items.size(); }
  /// The face or edge at a place of the order.
  std::int32_t operator[](std::size_t place) const { return sort_.items[place].index; }
  /// The cube of the codes, which holds all vertices at the start.
  const MortonFrame& frame() const { return frame_; }
  std::size_t bytes() const { return sort_.bytes(); }

 private:
  KeySort sort_;
  MortonFrame frame_{};
};

}  // namespace lazyccd
