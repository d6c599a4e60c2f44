// Interface to the vectorized kernels: boxes, candidates of a pair of groups, filter, and the tests
// for a minimum separation. Compiled once for each instruction set (cpu/isa); the results are the
// same.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/bvh/group.h"
#include "core/narrow/contact_math.h"
#include "core/narrow/contact_reduction.h"
#include "core/narrow/self_separation.h"

namespace lazyccd {

/// Input of the kernels in one step. `records` holds eight doubles per vertex (VertexRecord).
/// `scale` is a power of two that brings all differences of positions to at most 2^6
/// (core/narrow/elementary.h).
struct LeafScene {
  const Group* groups;
  const MotionBox* boxes;
  const Block* blocks;
  const double* records;
  MeshView mesh;
  double scale;
  bool vertex_face, edge_edge;
  Separations separation;  // minimum separations; between_bodies is 0: primitives must touch
  // By how much the distance of two points may differ, scaled, because the end of the step is not
  // known yet.
  float unknown_distance;
  bool single_first;  // use single precision first
  // Counter of the pairs that the non-penetration filter rules out; null: the filter is off.
  std::int64_t* filtered_noncoplanar;
  FirstFaces first_faces;  // first_faces.of is null: report every pair, without reduction
};

/// Box of a vertex at both ends of the step. The lower sides are negated, so that a union is one
/// maximum. The first eight numbers are the lower sides, the last eight the upper sides. The last
/// two of each eight are unused.
struct alignas(64) VertexBox {
  float side[16];

  const float* lower(int end) const { return side + 3 * end; }
  const float* upper(int end) const { return side + 8 + 3 * end; }
};

/// Candidates of one worker that wait for the filter.
struct CandidateQueue {
  static constexpr int capacity = 1024;
  // One row of a leaf adds at most this many candidates without checking for space.
  static constexpr int max_per_row = 64;
  int count = 0;
  Candidate items[capacity];
};

/// Two queues of candidates, and a function that empties them.
struct CandidateSink {
  CandidateQueue queues[2];  // by ContactKind
  // Frees space in the queue of one kind. Called if fewer than max_per_row places are free. A
  // function pointer instead of a virtual function: objects compiled for one instruction set must
  // not define a vtable, because the linker might use it for all (check_isa_objects.cmake).
  void (*drain)(CandidateSink& self, ContactKind kind);
};

/// A candidate that the filter could not rule out: a certain hit at a time in [lo, hi], or
/// undecided.
struct Survivor {
  Candidate pair;
  float lo, hi;
  bool hit;
};

/// A candidate whose distance falls to the minimum separation, or may do so.
struct Approach {
  Candidate pair;
  double t = 0;               // time at which the distance does, in [0, 1] of the step
  bool is_redundant = false;  // another pair is reported instead at the start of the step
                              // (core/narrow/contact_reduction.h)
  float min_distance = 0;     // lower bound of the distance at the start of the step, scaled
};

/// A candidate of a Verlet list, which outlives the step (cpu/verlet/verlet_list.h).
struct ListedCandidate {
  Candidate pair;
  // Lower bound of the distance at the start of the step of the list, plus by how much its
  // separation is smaller than that between bodies; scaled.
  float min_distance;
  std::uint32_t groups;  // index into ListedPairs::pairs
};

/// Candidates, split by their distance in single precision. Each list keeps the order of the input.
struct NearSplit {
  // Some elements are written beyond the count.
  static constexpr int capacity = CandidateQueue::capacity + 16;
  Candidate near[capacity];           // certainly within the separation at the start of the step
  float near_min_distance[capacity];  // of `near`, as Approach::min_distance
  Approach kept[capacity];            // the candidates of `near` that are not redundant
  Candidate far[capacity];            // certainly beyond the separation during the whole step
  float far_min_distance[capacity];   // of `far`, as Approach::min_distance
  Approach undecided[capacity];       // all other candidates
  int near_count, kept_count, far_count, undecided_count;
};

/// Point and normal of a contact, as in Contact.
struct ContactPlace {
  float u, v;
  std::array<float, 3> normal;
};

/// The kernels for one instruction set.
struct LeafKernels {
  const char* name;  // "baseline", "avx2" or "avx512"
  // Computes the boxes of vertices first to last - 1: positions times `scale`, a power of two,
  // rounded outward. Each box is wider by `margin` (scaled) on every side.
  void (*box_vertices)(const double* records, double scale, double margin, std::size_t first,
                       std::size_t last, VertexBox* boxes);
  // Computes the boxes of the groups first to last - 1 and of all primitives in their blocks.
  // vertices[-1] is read for unused lanes and must be an empty box.
  void (*box_groups)(const VertexBox* vertices, const Group* groups, std::size_t first,
                     std::size_t last, Block* blocks, MotionBox* boxes);
  // Adds to the sink all pairs of primitives of the groups a and b whose boxes may meet. a may
  // equal b. Two groups of one body meet only where their distance can fall to the separation
  // within that body. Returns false and adds nothing if the groups certainly stay apart. Candidates
  // are ordered as in Contact.
  bool (*visit)(const LeafScene& scene, std::int32_t a, std::int32_t b, CandidateSink& sink);
  // Filters `count` candidates for touching. Writes the survivors and returns their number.
  int (*filter)(const LeafScene& scene, ContactKind kind, const Candidate* candidates, int count,
                Survivor* survivors);
  // Splits at most CandidateQueue::capacity candidates by their distance. The two primitives of
  // each candidate must be ordered as in Contact.
  void (*near_at_start)(const LeafScene& scene, ContactKind kind, const Candidate* candidates,
                        int count, NearSplit& split);
  // Tests at most CandidateQueue::capacity approaches as decide_within() of
  // core/narrow/separation.h does. Keeps those that come within their minimum separation, sets
  // their t, and returns their number.
  int (*within)(const LeafScene& scene, ContactKind kind, Approach* approaches, int count);
  // Computes point and normal of each approach at its tick, as describe_contact() does.
  void (*describe)(const LeafScene& scene, ContactKind kind, const Approach* approaches, int count,
                   ContactPlace* places);
};

/// Returns the best kernels that this processor runs.
const LeafKernels* best_leaf_kernels();
/// Returns the kernels of the named set ("baseline", "avx2", "avx512"), or null if the processor or
/// this build lacks it.
const LeafKernels* leaf_kernels(const char* name);

}  // namespace lazyccd
