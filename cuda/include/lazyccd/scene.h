// What the core is told about a scene: topology once, positions every step.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "lazyccd/span.h"

namespace lazyccd {

using Face = std::array<std::int32_t, 3>;  // three vertex indices
using Edge = std::array<std::int32_t, 2>;  // two vertex indices

// Two different bodies A and B collide where (A.group & B.mask) and (B.group & A.mask) are both
// nonzero and the pair is not disabled; a body collides with itself where self_collision says so.
struct Body {
  std::uint32_t group = 1;
  std::uint32_t mask = ~std::uint32_t{0};
  bool self_collision = true;
};

using BodyPair = std::array<std::int32_t, 2>;  // two body indices, in any order

// The primitives of all bodies in one index space. The detector copies what it needs.
//   faces           triangles over vertex indices; their sides become edges by themselves
//   edges           further edges that are a side of no face (ropes); a repeated one counts once
//   body_of_vertex  body index of each vertex; empty: every vertex belongs to body 0
//   inverse_mass    1/kg of each vertex, 0 for a pinned one; empty: no vertex is pinned.
//                   Pairs whose four vertices are all pinned are not reported.
//   self_separation      of each vertex, 0 or more; empty: no limit. Where the step begins, two primitives
//                   of one body are near, as DetectorOptions::separation has it, only up to the largest of
//                   each, for neighbours in a mesh are near by themselves. How far apart they are
//                   is told in single precision, from below.
//   bodies          empty: as many bodies with default filters as body_of_vertex names
// Two primitives that share a vertex never form a pair. Non-manifold edges are legal.
struct Topology {
  std::size_t vertex_count = 0;
  Span<const Face> faces;
  Span<const Edge> edges;
  Span<const std::int32_t> body_of_vertex;
  Span<const float> inverse_mass;
  Span<const float> self_separation;
  Span<const Body> bodies;
  Span<const BodyPair> disabled_pairs;
};

// Positions of all vertices at one end of the step, metres (any unit works: nothing in the core is
// absolute), in float or double, three consecutive scalars a vertex, `stride` bytes apart.
class Positions {
 public:
  Positions(const float* xyz, std::size_t count, std::size_t stride = 3 * sizeof(float))
      : data_(xyz), count_(count), stride_(stride), is_double_(false) {}
  Positions(const double* xyz, std::size_t count, std::size_t stride = 3 * sizeof(double))
      : data_(xyz), count_(count), stride_(stride), is_double_(true) {}

  std::size_t count() const { return count_; }
  std::size_t stride() const { return stride_; }
  bool is_double() const { return is_double_; }
  const void* data() const { return data_; }

  std::array<double, 3> operator[](std::size_t i) const {
    const char* p = static_cast<const char*>(data_) + i * stride_;
    if (is_double_) {
      const double* d = reinterpret_cast<const double*>(p);
      return {d[0], d[1], d[2]};
    }
    const float* f = reinterpret_cast<const float*>(p);
    return {f[0], f[1], f[2]};
  }

 private:
  const void* data_;
  std::size_t count_;
  std::size_t stride_;
  bool is_double_;
};

}  // namespace lazyccd
