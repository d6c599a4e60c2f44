// The scene and the lists of a step as the kernels see them: structures of device pointers, passed
// by value.
#pragma once

#include <cstdint>

#include "core/bvh/tree.h"
#include "core/narrow/contact_key.h"
#include "core/narrow/contact_math.h"
#include "core/narrow/contact_reduction.h"
#include "core/narrow/self_separation.h"
#include "gpu/scene/group_view.cuh"
#include "gpu/scene/traversal_counters.h"
#include "lazyccd/device.h"
#include "lazyccd/scene.h"

namespace lazyccd::gpu {

/// A vertex over the step, in the precision of the positions. Loaded in three pieces of 16 bytes
/// (FloatRecord: two).
struct alignas(16) DoubleRecord {
  double x[6];  // start x y z, end x y z
};
struct alignas(16) FloatRecord {
  float x[8];  // start x y z, end x y z, two unused
};

/// An axis-aligned box over the whole step.
struct SweptBox {
  float lo[3], hi[3];
};
/// Leaves of a run. The boxes of these consecutive leaves are united once, for all nodes above
/// them.
constexpr int kRun = 16;

/// What a step with a separation leaves out and records, on the device.
struct NearView {
  FirstFaces first_faces;         // first_faces.of is null: no pairs are reduced
  const char* edges_left_out;     // by edge; null: none, as the next one
  const char* vertices_left_out;  // by vertex
  const char* resting;            // by body
  // By body: the bits of a double, the least distance of its near pairs at the start of the step.
  // They are in the order of the distances, because these are not negative.
  unsigned long long* min_distance;
};

/// The scene on the device.
struct SceneView {
  // Set with the mesh and the hierarchy; is_double in each step.
  std::uint32_t vertex_count, group_count, node_count;
  GroupView groups;
  MeshView mesh;
  const unsigned char* pinned;     // per vertex; null if no vertex is pinned
  const std::int32_t* leaf_order;  // groups in the order of the tree's leaves
  const int2* node_ranges;         // per node: its part [x, y) of leaf_order
  ContactKey key;
  Separations separation;       // within_body: on the device
  NearView near;                // only with a separation
  bool is_double;               // whether the records are DoubleRecord
  const unsigned char* active;  // per body: whether the step detects it; null: all bodies

  // Recomputed in each step.
  void* records;  // per vertex, DoubleRecord or FloatRecord
  SweptBox* runs;
  TreeNode* nodes;

  /// Returns whether the step detects a body.
  __device__ bool detects(std::int32_t body) const {
    return active == nullptr || active[body] != 0;
  }
};

/// A candidate that single precision decided to be a hit. It has one root, which lies in [lo, hi].
struct Survivor {
  Candidate pair;
  float lo, hi;
};

/// A candidate with its ContactKind, for lists that hold both kinds.
struct HardQuery {
  Candidate pair;
  std::int32_t kind;
};

/// An output list. The count goes on beyond the capacity, so that the host sees how much is missing
/// and enlarges the list.
template <class T>
struct Output {
  T* items;
  std::uint32_t capacity;
  std::uint32_t* count;
};

/// Work items that the warps of the decide kernel have claimed or, in undecided_done, finished.
struct DecideCounters {
  std::uint32_t undecided, undecided_done, hits, hard;
};

/// All counters of a step in one structure: cleared by one kernel, read by one copy.
struct StepCounters {
  std::uint32_t bad_positions;   // bits: 1 a position is not finite, 2 one is too large for float
  std::uint32_t next_leaf_pair;  // claimed by the warps of the leaf kernel
  std::uint32_t filtered[2];     // passed the non-coplanar filter
  std::uint32_t hits[2];         // decided in single precision
  std::uint32_t undecided_in_single[2];
  std::uint32_t near[2];  // within the separation
  std::uint32_t double_precision_tests;
  std::uint32_t hard;                 // queries that need subdivision
  std::uint32_t undecided_in_double;  // queries for exact arithmetic
  std::uint32_t too_wide;             // those among them that need the host's integers of any size
  std::uint32_t contacts;
  std::uint32_t contacts_vf;  // the vertex-face contacts among them
  DecideCounters decide;
  float leaf_area;              // sum of half the surface areas of the groups' swept boxes
  std::uint64_t candidates[2];  // by ContactKind
  std::uint64_t hash;
};

/// Where the last kernel of a step reports to a caller on the device, and what it needs for that.
struct StatusReport {
  DeviceStatus* status;  // null: no report
  const TraversalCounters* traversal;
  std::uint32_t leaf_pairs, front_nodes;  // capacities of the traversal's outputs
};

/// The lists of a step. Arrays of two are indexed by ContactKind.
struct StepLists {
  Output<Candidate> filtered[2];
  Output<Survivor> hits[2];                  // decided in single precision
  Output<Candidate> undecided_in_single[2];  // left over by single precision
  Output<Candidate> near[2];                 // within the separation, in no particular order
  // Queries for subdivision; for exact arithmetic; for the host's, with integers of any size.
  Output<HardQuery> hard, undecided_in_double, too_wide;
  Output<Contact> contacts;   // in no particular order
  std::uint64_t* keys;        // keys[i] is the ContactKey of contacts.items[i], or its lower word
  std::uint64_t* upper_keys;  // its upper word; null if a key is one word
  // For a counting sort by the upper part of the key, which is all but primitive b. bins: number of
  // contacts per bin. ranks: index of each contact within its bin. bins is null if there are too
  // many bins for it, or few contacts; then another sort is used.
  std::uint32_t *bins, *ranks;
  StepCounters* counters;
  StatusReport report;
};

}  // namespace lazyccd::gpu
