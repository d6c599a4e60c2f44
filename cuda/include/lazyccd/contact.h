// What the detector returns: the contacts of one step, in a fixed order.
#pragma once

#include <array>
#include <cstdint>
#include <tuple>

namespace lazyccd {

/// Kind of an elementary test, and of the contact that it finds.
enum class ContactKind : std::int32_t { vertex_face = 0, edge_edge = 1 };

/// Index in Contact::vertices of the first vertex of b.
constexpr int first_vertex_of_b(ContactKind kind) {
  return kind == ContactKind::vertex_face ? 1 : 2;
}

/// One vertex that touches one face, or one edge that touches another, during the linear motion of
/// a step. With DetectorOptions::separation: two primitives whose distance falls to the separation,
/// or is below it at the start.
///
///   vertices      vertex_face: the vertex, then the three of the face;
///                 edge_edge: the two of edge a, then the two of edge b
///   primitive_a   vertex_face: the vertex; edge_edge: index of edge a in Detector::edges()
///   primitive_b   vertex_face: the face; edge_edge: index of edge b (a < b by body, then by index)
///   toi           time of impact as a fraction of the step, in [0, 1]: the first time of contact,
///                 rounded down to a multiple of 2^-32. So it is never late, and the same on every
///                 backend.
///   u, v          the contact point, at the time of impact.
///                 vertex_face: barycentric coordinates of face vertices 1 and 2;
///                 edge_edge: parameters in [0, 1] along edge a and along edge b
///   normal        unit vector from b towards a (from the face to the vertex). Its sign makes the
///                 gap at the start, normal . sum_i weights[i] x_i, positive. If that gap is zero,
///                 the sign makes the gap shrink over the step. With DetectorOptions::separation
///                 the normal lies along the gap at the time of impact, unless that gap is zero.
struct Contact {
  ContactKind kind;
  std::int32_t body_a, body_b;            ///< indices of the bodies
  std::int32_t primitive_a, primitive_b;  ///< indices of the vertex and the face, or of the edges
  std::array<std::int32_t, 4> vertices;   ///< indices of the vertices of a, then of b
  float u, v;                             ///< contact point within the primitives, no unit
  std::array<float, 3> normal;            ///< unit vector from b towards a
  double toi;                             ///< time of impact, in steps: 0 is the start, 1 the end

  /// Weights w of the four vertices. Their sum is zero, and sum_i w_i x_i is the vector from the
  /// contact point on b to the contact point on a.
  /// vertex_face: (1, -(1-u-v), -u, -v); edge_edge: (1-u, u, -(1-v), -v).
  std::array<double, 4> weights() const {
    const double p = u, q = v;
    if (kind == ContactKind::vertex_face) return {1.0, -(1.0 - p - q), -p, -q};
    return {1.0 - p, p, -(1.0 - q), -q};
  }
};

/// The order in which the detector returns contacts: by bodies, kind and primitives. It is strict:
/// no two contacts of one step compare equal.
inline bool operator<(const Contact& x, const Contact& y) {
  return std::tie(x.body_a, x.body_b, x.kind, x.primitive_a, x.primitive_b) <
         std::tie(y.body_a, y.body_b, y.kind, y.primitive_a, y.primitive_b);
}

}  // namespace lazyccd
