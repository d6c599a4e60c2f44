// The leaves of the hierarchy: groups of up to 16 faces, with the vertices and edges they own.
//
// Every vertex, edge and face is owned by exactly one group (representative features, Curtis et al.
// 2008), and the traversal visits every pair of overlapping groups once. So each elementary test runs
// exactly once, no pair of triangles is ever tested, adjacent or not, and the tests that orphan sets
// would supply (Tang et al. 2009) come with the pair of groups that own the two features.
#pragma once

#include <cstdint>

#include "core/platform.h"

namespace lazyccd {

constexpr int kBlockLanes = 16;   // primitives side by side in a block
constexpr int kGroupCells = 16;   // faces (or free edges) of a group at most

// Boxes at both ends of the step, rounded outward to float. Kept apart and not swept into one, they
// also decide the linear motion: apart on the same side at both ends is apart all the time.
struct MotionBox {
  float lo0[3], hi0[3];  // at the start
  float lo1[3], hi1[3];  // at the end
};

// Sixteen primitives of one kind. Unused lanes hold boxes that are apart from everything.
struct alignas(64) Block {
  float lo0[3][kBlockLanes], hi0[3][kBlockLanes];
  float lo1[3][kBlockLanes], hi1[3][kBlockLanes];
  std::int32_t id[kBlockLanes];         // of the vertex, edge or face
  std::int32_t vertex[3][kBlockLanes];  // its vertices, unused ones -1
};

enum PrimitiveKind { kVertices, kEdges, kFaces };

struct Group {
  std::int32_t body;
  std::int32_t pinned;          // nonzero where none of its vertices moves freely
  std::int32_t first[3];        // first block of its vertices, edges, faces
  std::int32_t count[3];        // how many primitives of each

  LAZYCCD_HD int blocks(int kind) const { return (count[kind] + kBlockLanes - 1) / kBlockLanes; }
};

}  // namespace lazyccd
