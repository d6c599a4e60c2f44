#include "host/bvh/cell_order.h"

#include <algorithm>

#include "core/bvh/morton.h"
#include "host/bvh/bounds.h"

namespace lazyccd {
namespace {

constexpr std::size_t kGrain = 1 << 12;  // cells that a thread takes at a time

}  // namespace

void CellOrder::build(const Mesh& mesh, const std::vector<VertexRecord>& vertices,
                      ThreadPool& pool) {
  const Cells& cells = mesh.cells();
  frame_ = find_bounds(vertices.size(), pool, [&](std::size_t v, Bounds& bounds) {
             bounds.add(vertices[v].x, vertices[v].x);
           }).morton_frame();
  sort_.items.resize(cells.primitives().size());
  pool.parallel_for(sort_.items.size(), kGrain, [&](std::size_t first, std::size_t last, int) {
    cells.for_each_part(first, last, [&](const CellSegment& segment, std::size_t a, std::size_t b) {
      for (std::size_t i = a; i < b; ++i) {
        const std::int32_t primitive = cells.primitives()[i];
        const auto code = [&](const auto& corners) {
          return centroid_code(frame_, corners.data(), static_cast<int>(corners.size()),
                               [&](std::int32_t v) { return vertices[v].x; });
        };
        sort_.items[i] = {
            segment.has_faces ? code(mesh.faces()[primitive]) : code(mesh.edges()[primitive]),
            primitive};
      }
    });
  });

  const std::vector<CellSegment>& segments = cells.segments();
  sort_.sort_parts(segments.size(), pool, [&](std::size_t i) -> KeySort::Part {
    const auto first = static_cast<std::size_t>(segments[i].first);
    return {first, first + static_cast<std::size_t>(segments[i].count)};
  });
}

}  // namespace lazyccd
