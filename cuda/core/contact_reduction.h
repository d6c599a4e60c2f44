// Pairs that say the same. Where the points of two primitives that are next to each other lie on an
// edge or a vertex, every face and edge that meets there makes such a pair: eight of a vertex and
// an edge, some fifty of two vertices. One of them stands for all: that of a vertex and the first
// face at the edge or the vertex opposite, where that is certainly within the separation too.
#pragma once

#include "core/contact_math.h"

namespace lazyccd {

// A parameter along an edge, or a barycentric coordinate, that counts as zero. So near a corner,
// faces that round differently would each take another for the one that stands for all.
constexpr float kBorder = 0x1p-10f;

// The smallest index of a face that is not pinned as a whole, or -1, at each edge and then at each
// vertex; and the edges of each face, (0 1), (1 2), (2 0). Null where every pair stands for itself.
struct FirstFaces {
  const std::int32_t* of;
  std::int32_t edges;  // of edges
  const std::int32_t (*sides)[3];
};

// How far the points at u and v are, at most, from the edge or the vertex that they count as lying
// on; `a` and `b` bound the lengths of e1 and e2. By so much, at most, the pair that would stand
// for them is farther apart than they are: the border is a part of an edge, not of the separation.
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

// What the closest points of a pair, at u and v as in Contact, count as lying on, in sum: of a face
// 1, 2, 4 where the corner 0, 1, 2 has no part in it; of edges a and b 1 and 4 at their second end,
// 2 and 8 at their first one. 0: on no border.
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

// Which of its features a pair is at, nobody foresees: no branches.
LAZYCCD_HD inline std::int32_t pick(bool yes, std::int32_t a, std::int32_t b) {
  return b ^ ((a ^ b) & -static_cast<std::int32_t>(yes));
}

// Whether another pair stands for this one, which is on_border() and nearer than the separation by
// more than border_width(). Where `first` is not null.
template <ContactKind kind>
LAZYCCD_HD inline bool is_spoken_for(const MeshView& mesh, const FirstFaces& first, Candidate pair,
                                     int on) {
  std::int32_t vertex, at;  // of the pair that would stand for all; index in first.of
  if constexpr (kind == ContactKind::vertex_face) {
    // The corner that is left, or the side of the two that are.
    constexpr std::int8_t left[8] = {0, 1, 2, 2, 0, 1, 0, 0};
    const bool corner = 0b1101000 >> on & 1;  // 3, 5 and 6
    vertex = pair.a;
    at = pick(corner, first.edges + mesh.faces[pair.b][left[on]], first.sides[pair.b][left[on]]);
  } else {
    const bool on_a = (on & 3) != 0, on_b = on >= 4;
    const std::int32_t a = mesh.edges[pair.a][on & 1], b = mesh.edges[pair.b][on >> 2 & 1];
    vertex = pick(on_a, a, b);
    at = pick(on_a, pick(on_b, first.edges + b, pair.b), pair.a);
  }
  const std::int32_t face = first.of[at];
  const std::int32_t* f = mesh.faces[face < 0 ? 0 : face];
  // Its own neighbours no face stands for.
  return (face >= 0) & (kind == ContactKind::edge_edge || face != pair.b) & (f[0] != vertex) &
         (f[1] != vertex) & (f[2] != vertex);
}

}  // namespace lazyccd
