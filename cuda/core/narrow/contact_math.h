// From a decided query to the contact that is reported, and the contact's share of the hash.
#pragma once

#include <cstdint>
#include <cstring>

#include "core/narrow/closest.h"
#include "core/narrow/decision.h"
#include "lazyccd/contact.h"

namespace lazyccd {

constexpr double kTick = 1.0 / 4294967296.0;  ///< unit of Contact::toi, 2^-32

/// The arrays that identify the primitives of a contact. Plain pointers, to host or device memory.
struct MeshView {
  const std::int32_t (*faces)[3];
  const std::int32_t (*edges)[2];
  const std::int32_t* body_of_vertex;
};

/// An elementary pair, as indices of the mesh: a vertex and a face, or two edges in any order.
struct Candidate {
  std::int32_t a, b;
};
LAZYCCD_HD inline bool operator==(Candidate x, Candidate y) { return x.a == y.a && x.b == y.b; }

/// Puts the pair in the order that Contact prescribes.
template <ContactKind kind>
LAZYCCD_HD inline Candidate in_order(const MeshView& mesh, Candidate pair) {
  if (kind == ContactKind::vertex_face) return pair;
  const std::int32_t a = mesh.body_of_vertex[mesh.edges[pair.a][0]];
  const std::int32_t b = mesh.body_of_vertex[mesh.edges[pair.b][0]];
  const bool swapped = a == b ? pair.b < pair.a : b < a;
  return {swapped ? pair.b : pair.a, swapped ? pair.a : pair.b};
}

/// Fills in the bodies, primitives and vertices of a candidate.
template <ContactKind kind>
LAZYCCD_HD inline void identify_contact(const MeshView& mesh, Candidate pair, Contact& c) {
  pair = in_order<kind>(mesh, pair);
  c.kind = kind;
  if constexpr (kind == ContactKind::vertex_face) {
    const std::int32_t* f = mesh.faces[pair.b];
    c.vertices = {pair.a, f[0], f[1], f[2]};
    c.body_a = mesh.body_of_vertex[pair.a];
    c.body_b = mesh.body_of_vertex[f[0]];
  } else {
    const std::int32_t *a = mesh.edges[pair.a], *b = mesh.edges[pair.b];
    c.body_a = mesh.body_of_vertex[a[0]];
    c.body_b = mesh.body_of_vertex[b[0]];
    c.vertices = {a[0], a[1], b[0], b[1]};
  }
  c.primitive_a = pair.a;
  c.primitive_b = pair.b;
}

/// Returns the power of two that scales `size`, a normal number, to at least 1 and below 4. Returns
/// 1 for other numbers.
LAZYCCD_HD inline double unit_scale(double size) {
  if (!(size > 0x1p-1020 && size <= 0x1.fffffffffffffp1023)) return 1;
  std::uint64_t bits;
  ::memcpy(&bits, &size, sizeof bits);
  const std::uint64_t exponent = bits >> 52;
  bits = (exponent < 2046 ? 2046 - exponent : 1) << 52;
  ::memcpy(&size, &bits, sizeof bits);
  return size;
}

/// Scales the differences to near 1, so that products of four of them neither overflow nor vanish.
template <class T>
LAZYCCD_HD inline Differences<T> in_unit_scale(Differences<T> d) {
  const Vec3<T> e1 = max_abs(d.e1), e2 = max_abs(d.e2), r = max_abs(d.r);
  const T size = lane_max(lane_max(lane_max(e1.x, e1.y), lane_max(e1.z, e2.x)),
                          lane_max(lane_max(e2.y, e2.z), lane_max(r.x, lane_max(r.y, r.z))));
  const T scale = unit_scale(size);
  for (int end = 0; end < 2; ++end) {
    d.e1[end] = scale * d.e1[end];
    d.e2[end] = scale * d.e2[end];
    d.r[end] = scale * d.r[end];
  }
  return d;
}

/// The place of a contact; u, v and normal as in Contact.
template <class T>
struct ContactPoint {
  T u, v;
  Vec3<T> normal;
};

/// Computes the closest points and a normal at the time of impact. `d` must be in unit scale. Plain
/// double arithmetic without contraction, so every backend gets the same bits.
///
/// separated: the query has a minimum separation. Unless the primitives touched from the start,
/// they are apart by the separation at that time, and the normal follows the gap between them.
template <ContactKind kind, class T>
LAZYCCD_HD inline ContactPoint<T> contact_point(const Differences<T>& d, const T& toi,
                                                bool separated) {
  using Mask = MaskOf<T>;
  const T zero = T(0.0), one = T(1.0);
  const Vec3<T> e1 = lerp(d.e1, toi), e2 = lerp(d.e2, toi), r = lerp(d.r, toi);
  const ClosestPoints<T> closest = closest_points<kind>(e1, e2, r);

  // The vector from the contact point of b to that of a, at both ends of the step. r points from a
  // to the vertex or to edge b, so edges need the other sign.
  Vec3<T> gap[2];
  for (int end = 0; end < 2; ++end) {
    gap[end] = kind == ContactKind::vertex_face
                   ? d.r[end] - (closest.u * d.e1[end] + closest.v * d.e2[end])
                   : closest.u * d.e1[end] - (d.r[end] + closest.v * d.e2[end]);
  }
  const Vec3<T> closing = gap[0] - gap[1];

  // The normal is the cross product. If the primitives are parallel or degenerate, it is the gap at
  // the start; if that is zero, the direction of approach; if nothing moves at all, a fixed axis.
  Vec3<T> n = cross(e1, e2);
  const Mask flat = !Mask(dot(n, n) > T(1e-20) * (dot(e1, e1) * dot(e2, e2)));
  n = select<T>(flat, gap[0], n);
  n = select<T>(Mask(flat & !Mask(dot(n, n) > zero)), closing, n);
  const T along = dot(n, gap[0]);
  T facing = select(Mask(Mask(along < zero) | Mask(along > zero)), along, dot(n, closing));
  if (separated) {
    const Mask apart = dot(closest.gap, closest.gap) > zero;
    n = select<T>(apart, closest.gap, n);
    facing = select(apart, T(kind == ContactKind::vertex_face ? 1.0 : -1.0), facing);
  }
  const T length = lane_sqrt(dot(n, n));
  const Mask some = length > zero;
  const T scale = select(some, T(select(facing < zero, -one, one) / length), zero);
  return {closest.u, closest.v, {scale * n.x, scale * n.y, select(some, T(scale * n.z), one)}};
}

/// Fills in u, v and the normal of a contact.
template <ContactKind kind>
LAZYCCD_HD inline void describe_contact(const QueryCoordinates& q, double toi, bool separated,
                                        Contact& contact) {
  const ContactPoint<double> point =
      contact_point<kind>(in_unit_scale(differences<kind>(q, 1.0)), toi, separated);
  contact.u = static_cast<float>(point.u);
  contact.v = static_cast<float>(point.v);
  contact.normal = {static_cast<float>(point.normal.x), static_cast<float>(point.normal.y),
                    static_cast<float>(point.normal.z)};
}

/// Mixes the bits of x (the finaliser of splitmix64, Steele et al. 2014).
LAZYCCD_HD inline std::uint64_t hash_mix(std::uint64_t x) {
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ x >> 27) * 0x94d049bb133111ebull;
  return x ^ x >> 31;
}

/// A contact's share of the hash of a step. The hash is the sum of the shares, so it does not
/// depend on the order of the contacts.
LAZYCCD_HD inline std::uint64_t hash_share(const Contact& c) {
  std::uint64_t h = hash_mix(static_cast<std::uint64_t>(c.toi * 4294967296.0) * 2 +
                             static_cast<std::uint64_t>(c.kind) + 0x9e3779b97f4a7c15ull);
  for (int i = 0; i < 4; ++i) h = hash_mix(h + static_cast<std::uint32_t>(c.vertices[i]));
  return h;
}

}  // namespace lazyccd
