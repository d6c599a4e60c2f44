// Contact reduction: finds pairs that have the same closest points. If the closest points of two
// nearby primitives lie on an edge or a vertex, every face and edge that meets there makes such a
// pair: eight for a vertex and an edge, some fifty for two vertices. One pair represents them all:
// that of a vertex and the first face at the opposite edge or vertex, if that pair is certainly
// within its separation too.
#pragma once

#include "core/narrow/contact_math.h"

namespace lazyccd {

/// A parameter along an edge, or a barycentric coordinate, below this value counts as zero. Without
/// such a margin, rounding could choose a different representative for each face near a corner.
constexpr float kBorder = 0x1p-10f;

/// For each edge and then for each vertex: the smallest index of a face there that is not pinned as
/// a whole, or -1. Also the edges of each face, (0 1), (1 2), (2 0). Null: no pairs are reduced.
struct FirstFaces {
  const std::int32_t* of;
  std::int32_t edges;  // number of edges; the vertices follow in `of`
  const std::int32_t (*sides)[3];
};

/// Returns an upper bound of the distance from the points at u and v to the edge or vertex that
/// they count as lying on. `a` and `b` bound the lengths of e1 and e2. The representative pair is
/// farther apart than this pair by at most that distance. It is needed because the border is a
/// fraction of an edge, not of the separation.
template <ContactKind kind, class T>
LAZYCCD_HD inline T border_width(const T& u, const T& v, const T& a, const T& b) {
  const T zero(0.0f), one(1.0f), border(kBorder);
  const auto left_out = [&](const T& w) { return select(w < border, lane_abs(w), zero); };
  if constexpr (kind == ContactKind::vertex_face) {
    return (left_out(u) + left_out(v) + left_out(one - u - v)) * (a + b);
  } else {
    return (left_out(u) + left_out(one - u)) * a + (left_out(v) + left_out(one - v)) * b;
  }
}

/// Returns what the closest points of a pair count as lying on, as a sum of flags; u and v as in
/// Contact. 0: no border.
///   vertex-face  1, 2, 4: corner 0, 1, 2 has no weight
///   edge-edge    1, 2: second, first end of edge a; 4, 8: second, first end of edge b
template <ContactKind kind, class T>
LAZYCCD_HD inline T on_border(const T& u, const T& v) {
  const T zero(0.0f), one(1.0f), border(kBorder);
  const auto counted = [&](const T& w, float as) { return select(w < border, T(as), zero); };
  if constexpr (kind == ContactKind::vertex_face) {
    return counted(one - u - v, 1) + counted(u, 2) + counted(v, 4);
  } else {
    return counted(one - u, 1) + counted(u, 2) + counted(one - v, 4) + counted(v, 8);
  }
}

/// Returns yes ? a : b without a branch, because the answer is unpredictable.
LAZYCCD_HD inline std::int32_t select_branchless(bool yes, std::int32_t a, std::int32_t b) {
  return b ^ ((a ^ b) & -static_cast<std::int32_t>(yes));
}

/// Whether another pair represents this one. `on` is on_border() of the pair. The pair must be
/// nearer than the separation of any pair that may represent it, by more than border_width().
/// first.of must not be null.
template <ContactKind kind>
LAZYCCD_HD inline bool is_redundant_pair(const MeshView& mesh, const FirstFaces& first,
                                         Candidate pair, int on) {
  std::int32_t vertex, at;  // vertex of the representative pair; index of its face in first.of
  if constexpr (kind == ContactKind::vertex_face) {
    // The corner that has weight, or the side between the two corners that have weight.
    constexpr std::int8_t remaining[8] = {0, 1, 2, 2, 0, 1, 0, 0};
    const bool corner = 0b1101000 >> on & 1;  // 3, 5 and 6
    vertex = pair.a;
    at = select_branchless(corner, first.edges + mesh.faces[pair.b][remaining[on]],
                           first.sides[pair.b][remaining[on]]);
  } else {
    const bool on_a = (on & 3) != 0, on_b = on >= 4;
    const std::int32_t a = mesh.edges[pair.a][on & 1], b = mesh.edges[pair.b][on >> 2 & 1];
    vertex = select_branchless(on_a, a, b);
    at = select_branchless(on_a, select_branchless(on_b, first.edges + b, pair.b), pair.a);
  }
  const std::int32_t face = first.of[at];
  const std::int32_t* f = mesh.faces[face < 0 ? 0 : face];
  // A face never represents pairs of its own vertices.
  return (face >= 0) & (kind == ContactKind::edge_edge || face != pair.b) & (f[0] != vertex) &
         (f[1] != vertex) & (f[2] != vertex);
}

}  // namespace lazyccd
