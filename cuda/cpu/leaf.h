// The work at a leaf of the traversal, a pair of groups: which primitives can touch, and the filter in
// lanes. Compiled once for each instruction set (cpu/isa); the results are the same.
#pragma once

#include <cstdint>

#include "core/contact_math.h"
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
  float scaled_separation;  // times scale, rounded up
  // Where the non-penetration filter counts what it rules out; null: it is off.
  std::int64_t* never_coplanar;
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

// A candidate that the filter could not rule out: a certain hit in [lo, hi], or undecided, as all are
// where there is a minimum separation.
struct Survivor {
  Candidate pair;
  float lo, hi;
  bool hit;
};

// A candidate that comes as near as the minimum separation, and when.
struct Approach {
  Candidate pair;
  double t;  // of the step
  bool ended;  // the search for t
};

struct LeafKernels {
  const char* name;
  // Whether the groups a and b certainly stay apart, then all their pairs of primitives; a may be b.
  // Returns whether the pair was opened.
  bool (*visit)(const LeafScene& scene, std::int32_t a, std::int32_t b, CandidateSink& sink);
  // Filters `count` candidates; writes the survivors and returns how many.
  int (*filter)(const LeafScene& scene, ContactKind kind, const Candidate* candidates, int count,
                Survivor* survivors);
  // Of at most CandidateQueue::capacity candidates those that come within the minimum separation, as
  // decide_within() of core/separation.h has it; writes them and returns how many.
  int (*within)(const LeafScene& scene, ContactKind kind, const Candidate* candidates, int count,
                Approach* approaches);
};

// The best kernels that this processor runs, or those of the named set ("baseline", "avx2",
// "avx512"); null where the processor lacks it.
const LeafKernels* best_leaf_kernels();
const LeafKernels* leaf_kernels(const char* name);

}  // namespace lazyccd
