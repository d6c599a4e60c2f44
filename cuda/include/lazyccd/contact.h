// What the detector returns: the contacts of one step, in a fixed order.
#pragma once

#include <array>
#include <cstdint>
#include <tuple>

namespace lazyccd {

enum class ContactKind : std::int32_t { vertex_face = 0, edge_edge = 1 };

// One vertex touching one face, or one edge touching another, during the linear motion of a step; with
// DetectorOptions::separation, coming as near as that.
//
//   vertices      vertex_face: the vertex, then the face's three; edge_edge: edge a's two, edge b's two
//   primitive_a   vertex_face: the vertex; edge_edge: index of edge a in Detector::edges()
//   primitive_b   vertex_face: the face;   edge_edge: index of edge b (a < b by body, then by index)
//   toi           time of impact in [0, 1] of the step: the first time of contact rounded down to a
//                 multiple of 2^-32 (so it is never late and the same on every backend)
//   u, v          vertex_face: barycentric coordinates of face vertices 1 and 2;
//                 edge_edge: parameters in [0, 1] along edge a and along edge b
//   normal        unit vector from b towards a (from the face to the vertex). Its sign is such that
//                 the gap at the start, normal . sum_i weights[i] x_i, is positive; where that gap is
//                 zero, such that the gap shrinks over the step. With DetectorOptions::separation: along
//                 the gap at the time of impact.
struct Contact {
  ContactKind kind;
  std::int32_t body_a, body_b;
  std::int32_t primitive_a, primitive_b;
  std::array<std::int32_t, 4> vertices;
  float u, v;
  std::array<float, 3> normal;
  double toi;

  // Weights w of the four vertices, sum zero: sum_i w_i x_i is the vector from the contact point of b
  // to that of a. vertex_face: (1, -(1-u-v), -u, -v); edge_edge: (1-u, u, -(1-v), -v).
  std::array<double, 4> weights() const {
    const double p = u, q = v;
    if (kind == ContactKind::vertex_face) return {1.0, -(1.0 - p - q), -p, -q};
    return {1.0 - p, p, -(1.0 - q), -q};
  }
};

// The order in which contacts leave the detector. No two contacts of a step are equal in it.
inline bool operator<(const Contact& x, const Contact& y) {
  return std::tie(x.body_a, x.body_b, x.kind, x.primitive_a, x.primitive_b) <
         std::tie(y.body_a, y.body_b, y.kind, y.primitive_a, y.primitive_b);
}

}  // namespace lazyccd
