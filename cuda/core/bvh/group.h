// The leaves of the hierarchy: groups of up to 16 faces, with the vertices and edges they own.
//
// Exactly one group owns each vertex, edge and face (representative features, Curtis et al. 2008).
// The traversal visits every pair of overlapping groups once. So each elementary test runs exactly
// once, and pairs of triangles are never tested, adjacent or not. The tests that orphan sets would
// supply (Tang et al. 2009) come with the pair of groups that own the two features.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

constexpr int kBlockLanes = 16;  ///< primitives side by side in a block
constexpr int kGroupCells = 16;  ///< largest number of faces (or free edges) of a group

/// Boxes at both ends of the step, rounded outward to float. They are kept separate instead of
/// being swept into one. So they also decide the linear motion: two boxes that are apart on the
/// same side at both ends are apart at all times.
struct MotionBox {
  float lo0[3], hi0[3];  // at the start
  float lo1[3], hi1[3];  // at the end
};

/// Sixteen primitives of one kind. Unused lanes hold boxes that are apart from everything.
struct alignas(64) Block {
  float lo0[3][kBlockLanes], hi0[3][kBlockLanes];
  float lo1[3][kBlockLanes], hi1[3][kBlockLanes];
  std::int32_t id[kBlockLanes];         // index of the vertex, edge or face
  std::int32_t vertex[3][kBlockLanes];  // its vertices; -1 if unused
};

enum PrimitiveKind { kVertices, kEdges, kFaces };

struct Group {
  std::int32_t body;
  std::int32_t pinned;    // nonzero if none of its vertices moves freely
  std::int32_t first[3];  // first block of its vertices, edges, faces
  std::int32_t count[3];  // number of its vertices, edges, faces
  // The largest and the smallest Topology::self_separation of the vertices of its cells; 0 and
  // infinite without it.
  float self_separation, least_self_separation;

  LAZYCCD_HD int blocks(int kind) const { return (count[kind] + kBlockLanes - 1) / kBlockLanes; }
};

}  // namespace lazyccd
