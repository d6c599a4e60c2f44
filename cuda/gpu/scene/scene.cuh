// The scene and the lists of a step as the kernels see them: plain pointers to device memory,
// passed by value.
#pragma once

#include <cstdint>

#include "core/contact_key.h"
#include "core/contact_math.h"
#include "core/tree.h"
#include "gpu/scene/group_view.cuh"
#include "lazyccd/scene.h"

namespace lazyccd::gpu {

// A vertex over the step in the precision in which the positions came. Three (two) 16-byte loads.
struct alignas(16) DoubleRecord {
  double x[6];  // start x y z, end x y z
};
struct alignas(16) FloatRecord {
  float x[8];  // start x y z, end x y z, two unused
};

struct SweptBox {
  float lo[3], hi[3];
};
constexpr int kRun = 16;  // leaves whose boxes are united once for all nodes above them

struct SceneView {
  // Fixed with the topology.
  std::uint32_t vertex_count, group_count, node_count;
  GroupView groups;
  MeshView mesh;
  const unsigned char* pinned;     // null where no vertex is
  const std::int32_t* leaf_order;  // groups in the order of the tree's leaves
  const int2* node_ranges;         // the part of that order below each node
  ContactKey key;
  double separation;  // DetectorOptions::separation
  bool is_double;     // of the records

  // Made anew each step.
  void* records;  // DoubleRecord or FloatRecord
  SweptBox* runs;
  TreeNode* nodes;
};

// A candidate that single precision found to be a hit, at its one root in [lo, hi].
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

// What the warps of the decide kernel have claimed and done.
struct DecideCounters {
  std::uint32_t undecided, undecided_done, hits, hard;
};

// All counters of a step in one piece: reset by one memset, read by one copy.
struct StepCounters {
  std::uint32_t bad_positions;   // bits: 1 one is not finite, 2 one is beyond what float can scale
  std::uint32_t next_leaf_pair;  // claimed by the warps of the leaf kernel
  std::uint32_t candidates[2];   // by ContactKind
  std::uint32_t filtered[2];     // that the non-coplanar filter left
  std::uint32_t hits[2];         // in single precision
  std::uint32_t undecided[2];
  std::uint32_t double_precision_tests;
  std::uint32_t hard;     // for subdivision
  std::uint32_t undecided;  // for the host's exact arithmetic
  std::uint32_t contacts;
  std::uint32_t contacts_vf;  // of those
  DecideCounters decide;
  float leaf_area;  // sum of half the surfaces of the groups' swept boxes
  std::uint64_t hash;
};

// The lists of a step; pairs of them by ContactKind.
struct StepLists {
  Output<Candidate> filtered[2];
  Output<Survivor> hits[2];        // of single precision
  Output<Candidate> undecided[2];  // by single precision
  Output<HardQuery> hard, undecided;
  Output<Contact> contacts;  // in no order
  std::uint64_t* keys;       // of the same places: their order (ContactKey)
  // Contacts by the upper part of their key, all but primitive b, while there are few such parts:
  // how many each has, and which of them a place is. Null: to be sorted in another way.
  std::uint32_t *bins, *ranks;
  StepCounters* counters;
};

}  // namespace lazyccd::gpu
