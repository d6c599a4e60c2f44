// The scene as the kernels see it: plain pointers to device memory, passed by value.
#pragma once

#include <cstdint>

#include "core/contact_math.h"
#include "core/group.h"
#include "core/tree.h"
#include "lazyccd/scene.h"

namespace lazyccd::gpu {

// A vertex over the step in the precision in which the positions came. Three (two) 16-byte loads.
struct alignas(16) DoubleRecord {
  double x[6];  // start x y z, end x y z
};
struct alignas(16) FloatRecord {
  float x[8];  // start x y z, end x y z, two unused
};

// A group on the device: its primitives lie side by side, vertices, edges, then faces.
struct DeviceGroup {
  std::int32_t body, pinned;
  std::int32_t first;
  std::int32_t count[3];

  LAZYCCD_HD int total() const { return count[0] + count[1] + count[2]; }
};

// A group's extent along the six face diagonals x+y, x-y, x+z, x-z, y+z, y-z at both ends of the step,
// rounded outward: with its box an 18-DOP (Klosowski et al. 1998). Layers that lie askew are apart here
// where their boxes are not.
constexpr int kDiagonals = 6;
struct alignas(16) DiagonalSlabs {
  float lo0[kDiagonals], hi0[kDiagonals];
  float lo1[kDiagonals], hi1[kDiagonals];
};

// A box and the names of a primitive: three and one 16-byte loads.
struct alignas(16) PrimitiveBox {
  MotionBox box;
};
struct alignas(16) PrimitiveNames {
  std::int32_t id;
  std::int32_t vertex[3];  // unused ones -1
};

struct SweptBox {
  float lo[3], hi[3];
};
constexpr int kRun = 32;  // leaves whose boxes are united once for all nodes above them

struct SceneView {
  // Fixed with the topology.
  std::uint32_t vertex_count, group_count, node_count;
  MeshView mesh;
  const unsigned char* pinned;  // null where no vertex is
  const Body* bodies;
  const std::uint64_t* disabled_pairs;  // sorted: smaller body << 32 | larger body
  std::uint32_t disabled_count;
  const DeviceGroup* groups;
  const PrimitiveNames* names;
  const std::int32_t* leaf_order;  // groups in the order of the tree's leaves
  const int2* node_ranges;         // the part of that order below each node
  int body_bits, a_bits, b_bits;   // of the sort key

  // Made anew each step.
  void* records;         // DoubleRecord or FloatRecord
  PrimitiveBox* primitives;
  PrimitiveBox* boxes;   // of groups
  DiagonalSlabs* slabs;  // of groups
  SweptBox* runs;        // of each kRun leaves in order
  TreeNode* nodes;

  LAZYCCD_HD bool collide(std::int32_t a, std::int32_t b) const {
    if (a == b) return bodies[a].self_collision;
    if (!(bodies[a].group & bodies[b].mask) || !(bodies[b].group & bodies[a].mask)) return false;
    const std::uint64_t lo = static_cast<std::uint32_t>(a < b ? a : b);
    const std::uint64_t key = lo << 32 | static_cast<std::uint32_t>(a < b ? b : a);
    std::uint32_t first = 0, last = disabled_count;
    while (first < last) {
      const std::uint32_t middle = first + (last - first) / 2;
      if (disabled_pairs[middle] < key) {
        first = middle + 1;
      } else {
        last = middle;
      }
    }
    return first == disabled_count || disabled_pairs[first] != key;
  }
};

// A candidate whose roots single precision has looked at: a certain hit in [lo, hi], or undecided
// (lo < 0).
struct Survivor {
  Candidate pair;
  float lo, hi;
};

// A candidate for the stages behind the lists by kind.
struct HardQuery {
  Candidate pair;
  std::int32_t kind;
};

// An output that counts on where it is full: the host sees by how much and grows it.
template <class T>
struct Output {
  T* items;
  std::uint32_t capacity;
  std::uint32_t* count;
};

// All counters of a step in one piece: reset by one memset, read by one copy.
struct StepCounters {
  std::uint32_t bad_positions;   // bits: 1 one is not finite, 2 one is beyond what float can scale
  std::uint32_t next_leaf_pair;  // claimed by the warps of the leaf kernel
  std::uint32_t group_pairs;
  std::uint32_t candidates[2];   // by ContactKind
  std::uint32_t filtered[2];     // that the non-coplanar filter left
  std::uint32_t survivors[2];
  std::uint32_t refined;
  std::uint32_t hard;            // for subdivision
  std::uint32_t residue;         // for the host's exact arithmetic
  std::uint32_t contacts;
  std::uint32_t contacts_vf;     // of those
  float leaf_area;               // sum of half the surfaces of the groups' swept boxes
  std::uint64_t hash;
};

}  // namespace lazyccd::gpu
