// Input of the detector: the topology, once, and the positions, in every step.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "lazyccd/span.h"

namespace lazyccd {

using Face = std::array<std::int32_t, 3>;  ///< three vertex indices
using Edge = std::array<std::int32_t, 2>;  ///< two vertex indices

/// World and collision filter of one body. Two bodies meet only if they are in the same world, or
/// if one of them is in every world. Two different bodies A and B collide if (A.group & B.mask),
/// (B.group & A.mask), (A.layer & B.layer_mask) and (B.layer & A.layer_mask) are all nonzero and
/// the pair is not disabled (Topology::disabled_pairs). Groups and layers are two independent
/// filters, so that an application's filter can be combined with one of its engine.
struct Body {
  std::uint32_t group = 1;                       ///< bits of the groups that the body belongs to
  std::uint32_t mask = ~std::uint32_t{0};        ///< bits of the groups that the body collides with
  bool self_collision = true;                    ///< whether the body collides with itself
  std::uint32_t layer = 1;                       ///< bits of the layers that the body belongs to
  std::uint32_t layer_mask = ~std::uint32_t{0};  ///< bits of the layers that it collides with
  /// Index of its world, from 0; -1: it is in every world. Worlds may be at the same place in
  /// space.
  std::int32_t world = 0;
};

/// True if groups and layers let two different bodies collide.
constexpr bool filters_accept(const Body& a, const Body& b) {
  return (a.group & b.mask) != 0 && (b.group & a.mask) != 0 && (a.layer & b.layer_mask) != 0 &&
         (b.layer & a.layer_mask) != 0;
}

using BodyPair = std::array<std::int32_t, 2>;  ///< two body indices, in any order

/// The primitives of all bodies, in one index space. Detector::set_topology() copies what it needs,
/// so the arrays may go away after it. Two primitives that share a vertex never form a pair.
/// Non-manifold edges are allowed. A vertex that no face and no edge uses has no contacts.
struct Topology {
  std::size_t vertex_count = 0;
  Span<const Face> faces;  ///< triangles; their sides become edges without being listed
  Span<const Edge> edges;  ///< edges that are no side of a face (ropes); duplicates count once

  /// Index of the body of each vertex. Empty: every vertex belongs to body 0.
  Span<const std::int32_t> body_of_vertex;

  /// Inverse mass of each vertex, 1/kg, >= 0; 0: the vertex is pinned. Only zero or not matters.
  /// Empty: no vertex is pinned. Pairs whose four vertices are all pinned are not reported.
  Span<const float> inverse_mass;

  /// Limit of the separation within one body, per vertex, >= 0, in the unit of the positions.
  /// Empty: no limit. The separation of two primitives a and b of one body is
  /// min(DetectorOptions::separation, max over a's vertices, max over b's vertices), but not below
  /// 2^-10 of DetectorOptions::separation. Keeps neighbours in a mesh from being in contact all the
  /// time, and saves the search for them.
  Span<const float> self_separation;

  /// World and collision filter of each body. Empty: default filters for all bodies in
  /// body_of_vertex.
  Span<const Body> bodies;

  Span<const BodyPair> disabled_pairs;  ///< pairs of bodies that do not collide with each other
};

/// View of the positions of all vertices at one end of the step. It does not own the memory.
/// Three consecutive floats or doubles per vertex, usually in metres. Any unit works: the detector
/// has no absolute lengths of its own.
class Positions {
 public:
  /// `count` vertices; `stride` is the distance in bytes from one vertex to the next.
  Positions(const float* xyz, std::size_t count, std::size_t stride = 3 * sizeof(float))
      : data_(xyz), count_(count), stride_(stride), is_double_(false) {}
  Positions(const double* xyz, std::size_t count, std::size_t stride = 3 * sizeof(double))
      : data_(xyz), count_(count), stride_(stride), is_double_(true) {}

  std::size_t count() const { return count_; }    ///< number of vertices
  std::size_t stride() const { return stride_; }  ///< bytes
  bool is_double() const { return is_double_; }
  const void* data() const { return data_; }

  /// Position of vertex i, converted to double. Does not check the index.
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
