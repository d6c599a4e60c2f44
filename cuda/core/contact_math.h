// From a decided query to the contact that is reported, and its share of the hash.
#pragma once

#include <cstdint>

#include "core/closest.h"
#include "core/decision.h"
#include "lazyccd/contact.h"

namespace lazyccd {

constexpr double kTick = 1.0 / 4294967296.0;  // unit of Contact::toi

// What names the primitives of a contact. Plain pointers: host or device memory.
struct MeshView {
  const std::int32_t (*faces)[3];
  const std::int32_t (*edges)[2];
  const std::int32_t* body_of_vertex;
};

// An elementary pair: vertex and face, or two edges in any order, as indices of the mesh.
struct Candidate {
  std::int32_t a, b;
};

// Bodies, primitives and vertices of a candidate, in the order that Contact promises.
template <ContactKind kind>
LAZYCCD_HD inline void identify_contact(const MeshView& mesh, Candidate pair, Contact& c) {
  c.kind = kind;
  if constexpr (kind == ContactKind::vertex_face) {
    const std::int32_t* f = mesh.faces[pair.b];
    c.vertices = {pair.a, f[0], f[1], f[2]};
    c.body_a = mesh.body_of_vertex[pair.a];
    c.body_b = mesh.body_of_vertex[f[0]];
  } else {
    c.body_a = mesh.body_of_vertex[mesh.edges[pair.a][0]];
    c.body_b = mesh.body_of_vertex[mesh.edges[pair.b][0]];
    if (c.body_b < c.body_a || (c.body_b == c.body_a && pair.b < pair.a)) {
      pair = {pair.b, pair.a};
      const std::int32_t body = c.body_a;
      c.body_a = c.body_b;
      c.body_b = body;
    }
    const std::int32_t *a = mesh.edges[pair.a], *b = mesh.edges[pair.b];
    c.vertices = {a[0], a[1], b[0], b[1]};
  }
  c.primitive_a = pair.a;
  c.primitive_b = pair.b;
}

// A power of two that brings the differences near one, so that products of four of them neither
// overflow nor vanish.
LAZYCCD_HD inline double unit_scale(const Differences<double>& d) {
  const Vec3<double> e1 = max_abs(d.e1), e2 = max_abs(d.e2), r = max_abs(d.r);
  const double size = lane_max(lane_max(lane_max(e1.x, e1.y), lane_max(e1.z, e2.x)),
                               lane_max(lane_max(e2.y, e2.z), lane_max(r.x, lane_max(r.y, r.z))));
  return size > 0x1p-1020 && size <= 0x1.fffffffffffffp1023 ? ::ldexp(1.0, -::ilogb(size)) : 1;
}

// Closest points, and a normal, at the time of impact, in plain double arithmetic without
// contraction, so that every backend gets the same bits. With `separated` the primitives are apart at
// that time, by the minimum separation, if they did not touch from the start.
template <ContactKind kind>
LAZYCCD_HD inline void describe_contact(const QueryCoordinates& q, double toi, bool separated,
                                        Contact& contact) {
  const Differences<double> d = differences<kind>(q, unit_scale(differences<kind>(q, 1.0)));
  const Vec3<double> e1 = lerp(d.e1, toi), e2 = lerp(d.e2, toi), r = lerp(d.r, toi);
  const ClosestPoints<double> closest = closest_points<kind>(e1, e2, r);
  contact.u = static_cast<float>(closest.u);
  contact.v = static_cast<float>(closest.v);

  // Where the contact points are from each other, from b to a, at both ends of the step. (r points
  // from a to the vertex or to edge b: the edges need the other sign.)
  Vec3<double> gap[2];
  for (int end = 0; end < 2; ++end) {
    gap[end] = kind == ContactKind::vertex_face
                   ? d.r[end] - (closest.u * d.e1[end] + closest.v * d.e2[end])
                   : closest.u * d.e1[end] - (d.r[end] + closest.v * d.e2[end]);
  }
  const Vec3<double> closing = gap[0] - gap[1];

  // The cross product, unless the primitives are parallel or degenerate; then the gap at the start,
  // then the direction of approach, and an axis where nothing moves at all.
  Vec3<double> n = cross(e1, e2);
  double size = dot(n, n);
  if (!(size > 1e-20 * (dot(e1, e1) * dot(e2, e2)))) {
    n = gap[0];
    size = dot(n, n);
    if (!(size > 0)) {
      n = closing;
      size = dot(n, n);
    }
  }
  double facing = dot(n, gap[0]) != 0 ? dot(n, gap[0]) : dot(n, closing);
  if (separated && dot(closest.gap, closest.gap) > 0) {
    n = closest.gap;
    size = dot(n, n);
    facing = kind == ContactKind::vertex_face ? 1 : -1;
  }
  const double length = lane_sqrt(size);
  const double scale = length > 0 ? (facing < 0 ? -1 : 1) / length : 0;
  contact.normal = {static_cast<float>(scale * n.x), static_cast<float>(scale * n.y),
                    length > 0 ? static_cast<float>(scale * n.z) : 1.0f};
}

// A contact's share of the hash of a step: the sum of the shares does not depend on any order
// (splitmix64's finaliser, Steele et al. 2014).
LAZYCCD_HD inline std::uint64_t hash_mix(std::uint64_t x) {
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ x >> 27) * 0x94d049bb133111ebull;
  return x ^ x >> 31;
}

LAZYCCD_HD inline std::uint64_t hash_share(const Contact& c) {
  std::uint64_t h = hash_mix(static_cast<std::uint64_t>(c.toi * 4294967296.0) * 2 +
                             static_cast<std::uint64_t>(c.kind) + 0x9e3779b97f4a7c15ull);
  for (int i = 0; i < 4; ++i) h = hash_mix(h + static_cast<std::uint32_t>(c.vertices[i]));
  return h;
}

}  // namespace lazyccd
