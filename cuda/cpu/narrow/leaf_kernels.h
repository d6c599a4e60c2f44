// The work at a leaf of the traversal, a pair of groups: which primitives can touch, and the filter in
// lanes. Compiled once for each instruction set (cpu/isa); the results are the same.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/contact_math.h"
#include "core/contact_reduction.h"
#include "core/group.h"

namespace lazyccd {

// What the leaf reads. `records` are the vertices' eight doubles; `scale` brings all differences
// of positions in the scene to at most 2^6 (core/elementary.h).
struct LeafScene {
  const Group* groups;
  const MotionBox* boxes;
  const Block* blocks;
  const double* records;
  MeshView mesh;
  double scale;
  bool vertex_face, edge_edge;
  double separation;        // minimum separation; 0 where contact is touching
  float certain_separation;  // what single precision takes for less is
  float certainly_beyond;    // and for more
  bool single_first;         // rely on it
  // Where the non-penetration filter counts what it rules out; null: it is off.
  std::int64_t* filtered_noncoplanar;
  FirstFaces first_faces;  // null where every pair is to stand for itself
};

// The box of a vertex at both ends of the step. The lower sides are negated, so that a union is one
// maximum. Of each eight the last two are of no meaning.
struct alignas(64) VertexBox {
  float side[16];

  const float* lower(int end) const { return side + 3 * end; }
  const float* upper(int end) const { return side + 8 + 3 * end; }
};

// One worker's candidates on their way to the filter.
struct CandidateQueue {
  static constexpr int capacity = 1024;
  static constexpr int room = 64;  // what one row of a leaf may add without asking
  int count = 0;
  Candidate items[capacity];
};

// Where full queues go.
struct CandidateSink {
  CandidateQueue queues[2];  // by ContactKind
  // Makes room in the queue of one kind; called when less than `room` is left.
  void (*drain)(CandidateSink& self, ContactKind kind);
};

// A candidate that the filter could not rule out: a certain hit in [lo, hi], or undecided.
struct Survivor {
  Candidate pair;
  float lo, hi;
  bool hit;
};

// A candidate that comes as near as the minimum separation, and when.
struct Approach {
  Candidate pair;
  double t = 0;             // of the step
  bool is_redundant = false;  // where the step begins: see core/contact_reduction.h
  float apart = 0;          // there, certainly, times scale
};

// A candidate for lists that outlast a step.
struct ListedCandidate {
  Candidate pair;
  float apart;           // where that step begins, certainly, times its scale
  std::uint32_t groups;  // which pair of groups: see cpu/near_list.h
};

// Candidates by what single precision tells of their separation, each list in their order.
struct NearSplit {
  static constexpr int capacity = CandidateQueue::capacity + 16;  // some are written and not counted
  Candidate near[capacity];        // certainly nearer, where the step begins
  Approach own[capacity];          // of these, those that no other speaks for
  Candidate away[capacity];        // certainly farther, all the time
  float away_apart[capacity];      // as Approach::apart
  Approach open[capacity];         // the rest
  int near_count, own_count, away_count, open_count;
  float apart;  // what is near, certainly, times scale
};

// Where a contact is, as Contact has it.
struct Place {
  float u, v;
  std::array<float, 3> normal;
};

struct LeafKernels {
  const char* name;
  // Boxes of vertices first to last - 1 times `scale`, a power of two, rounded outward and wider by
  // `margin` on every side.
  void (*box_vertices)(const double* records, double scale, double margin, std::size_t first,
                       std::size_t last, VertexBox* boxes);
  // Boxes of the groups first to last - 1 and of all that is in their blocks. The vertex of unused
  // lanes, -1, is to have an empty box.
  void (*box_groups)(const VertexBox* vertices, const Group* groups, std::size_t first,
                     std::size_t last, Block* blocks, MotionBox* boxes);
  // Whether the groups a and b certainly stay apart, then all their pairs of primitives; a may be b.
  // Returns whether the pair was opened. Candidates are in order.
  bool (*visit)(const LeafScene& scene, std::int32_t a, std::int32_t b, CandidateSink& sink);
  // Filters `count` candidates for touching; writes the survivors and returns how many.
  int (*filter)(const LeafScene& scene, ContactKind kind, const Candidate* candidates, int count,
                Survivor* survivors);
  // Splits at most CandidateQueue::capacity candidates, which are in order.
  void (*near_at_start)(const LeafScene& scene, ContactKind kind, const Candidate* candidates,
                        int count, NearSplit& split);
  // Of at most CandidateQueue::capacity approaches those that come within the minimum
  // separation, as decide_within() of core/separation.h has it; keeps them and returns how many.
  int (*within)(const LeafScene& scene, ContactKind kind, Approach* approaches, int count);
  // Of each approach the place at its tick, as describe_contact() has it.
  void (*describe)(const LeafScene& scene, ContactKind kind, const Approach* approaches, int count,
                   Place* places);
};

// The best kernels that this processor runs, or those of the named set ("baseline", "avx2",
// "avx512"); null where the processor lacks it.
const LeafKernels* best_leaf_kernels();
const LeafKernels* leaf_kernels(const char* name);

}  // namespace lazyccd
