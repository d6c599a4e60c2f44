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
// vertex; and the edges of each face, (0 1), (1 2), (2 0). Null where every pair is to stand for
// itself.
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

// Whether the closest points of a pair count as lying on an edge or a vertex.
template <ContactKind kind, class T>
LAZYCCD_HD inline MaskOf<T> is_on_border(const T& u, const T& v) {
  using Mask = MaskOf<T>;
  const T one(1.0f), border(kBorder);
  const Mask low = Mask((u < border) | (v < border));
  return kind == ContactKind::vertex_face
             ? Mask(low | (one - u - v < border))
             : Mask(low | Mask((one - u < border) | (one - v < border)));
}

// Whether another pair stands for this one, whose closest points are at u and v, as in Contact, on
// the border, and which is nearer than the separation by more than border_width(). Where `first` is
// not null. With few branches: which of its features a pair is at, nobody foresees.
template <ContactKind kind>
LAZYCCD_HD inline bool is_spoken_for(const MeshView& mesh, const FirstFaces& first, Candidate pair,
                                     float u, float v) {
  std::int32_t vertex, at;  // of the pair that would stand for all; index in first.of
  if constexpr (kind == ContactKind::vertex_face) {
    const int off = (1 - u - v < kBorder) | (u < kBorder) << 1 | (v < kBorder) << 2;  // by corner
    // By `off`: the corner that is left, or the side of the two that are.
    constexpr std::int8_t left[8] = {0, 1, 2, 2, 0, 1, 0, 0};
    const bool corner = off == 3 || off == 5 || off == 6;
    vertex = pair.a;
    const std::int32_t side = first.sides[pair.b][left[off]];
    const std::int32_t point = first.edges + mesh.faces[pair.b][left[off]];
    at = corner ? point : side;
  } else {
    const bool a1 = 1 - u < kBorder, b1 = 1 - v < kBorder;
    const bool on_a = a1 | (u < kBorder), on_b = b1 | (v < kBorder);
    const std::int32_t a = mesh.edges[pair.a][a1], b = mesh.edges[pair.b][b1];
    vertex = on_a ? a : b;
    const std::int32_t other = on_b ? first.edges + b : pair.b;
    at = on_a ? other : pair.a;
  }
  const std::int32_t face = first.of[at];
  if (face < 0 || (kind == ContactKind::vertex_face && face == pair.b)) return false;
  // Its own neighbours no face stands for.
  const std::int32_t* f = mesh.faces[face];
  return (f[0] != vertex) & (f[1] != vertex) & (f[2] != vertex);
}

}  // namespace lazyccd
