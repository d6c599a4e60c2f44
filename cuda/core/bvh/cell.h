// The cells from which the groups are cut: faces and free edges, and who owns what they contain.
// Both backends build their groups with this.
#pragma once

#include <cstdint>

#include "core/bvh/group.h"
#include "core/platform.h"

namespace lazyccd {

/// Cells [first, last) of an order of cells.
struct CellRange {
  std::int32_t first, last;
};

/// The faces of a body, or its free edges: consecutive cells. Groups do not reach beyond a segment.
struct CellSegment {
  std::int32_t body;
  std::int32_t has_faces;    // whether the cells are faces
  std::int32_t first;        // first cell
  std::int32_t count;        // number of cells
  std::int32_t first_group;  // first of its groups of kGroupCells cells

  LAZYCCD_HD std::int32_t groups() const { return (count + kGroupCells - 1) / kGroupCells; }
  /// The cells of one of its groups.
  LAZYCCD_HD CellRange cells_of(std::int32_t group) const {
    const std::int32_t begin = first + (group - first_group) * kGroupCells;
    const std::int32_t end = begin + kGroupCells, all = first + count;
    return {begin, end < all ? end : all};
  }
};

/// What cells contain. Plain pointers, to host or device memory.
struct CellView {
  const std::int32_t (*faces)[3];
  const std::int32_t (*face_edges)[3];  // by face: its sides (0 1), (1 2), (2 0)
  const std::int32_t (*edges)[2];       // as (smaller, larger) vertex
};

/// The edges and vertices of a cell, in the order in which a group lists them.
struct CellContents {
  int edges, vertices;  // their numbers
  std::int32_t edge[3], vertex[3];

  LAZYCCD_HD CellContents(const CellView& view, bool is_face, std::int32_t cell)
      : edges(is_face ? 3 : 1), vertices(is_face ? 3 : 2), edge{cell, -1, -1}, vertex{-1, -1, -1} {
    for (int k = 0; k < vertices; ++k) {
      vertex[k] = is_face ? view.faces[cell][k] : view.edges[cell][k];
      if (is_face) edge[k] = view.face_edges[cell][k];
    }
  }
  /// One end of an edge, as CellView::edges has it: the smaller (0) or the larger vertex (1).
  LAZYCCD_HD std::int32_t end(int i, int which) const {
    const std::int32_t a = vertex[i], b = vertex[i + 1 == vertices ? 0 : i + 1];
    return (a < b) == (which == 0) ? a : b;
  }
};

/// Which edges and vertices of a cell its group owns through it, a bit for each: those of which
/// this is the first cell in the order of all cells.
struct OwnedContents {
  std::uint8_t edges, vertices;
};

/// first_of_edge(e) and first_of_vertex(v): the place of the first cell that contains it.
template <class FirstOfEdge, class FirstOfVertex>
LAZYCCD_HD inline OwnedContents owned_contents(const CellContents& cell, std::uint32_t place,
                                               FirstOfEdge&& first_of_edge,
                                               FirstOfVertex&& first_of_vertex) {
  int edges = 0, vertices = 0;
  for (int k = 0; k < cell.edges; ++k) edges |= (first_of_edge(cell.edge[k]) == place) << k;
  for (int k = 0; k < cell.vertices; ++k)
    vertices |= (first_of_vertex(cell.vertex[k]) == place) << k;
  return {static_cast<std::uint8_t>(edges), static_cast<std::uint8_t>(vertices)};
}

}  // namespace lazyccd
