// One sweep over the rows of a contact problem, four rows at a time. Compiled once for each
// instruction set (plugin/isa); the results are the same.
#pragma once

#include <cstdint>

namespace lazyccd::bullet {

// Of each four floats three are x, y and z, unless said otherwise; the last one is zero.
struct alignas(16) Float4 {
  float x[4];
};

// Rows that move nothing in common. In place of a missing one there are zeros, but for `pushed`.
struct alignas(64) RowBatch {
  static constexpr int rows = 4, vertices = 4 * rows;
  float normal[4 * rows], sliding[4 * rows];   // sliding: without impulses
  float weight[4 * rows], mobility[4 * rows];  // by vertex; mobility: weight over mass
  // How much further apart along the normal than without impulses, at least; response; friction;
  // response across the normal.
  float terms[4 * rows];
  // Impulses: three across the normal, and along it. `last`: at the end of the sweep before.
  float impulse[4 * rows], last[4 * rows];
  float compliance[4 * rows];  // displacement per impulse
  // Index of the displacement; 0: nothing moves it. `pushed`: the same, but for what nothing moves
  // the vertex's own of those that nobody reads, where nothing waits for it.
  std::int32_t node[vertices], pushed[vertices];
  std::int32_t first_part = 0, last_part = 0;  // one past the last
};

// Rows that have no impulse, and get none unless they come to lack something. They may move things
// in common. In place of a missing one there are zeros.
struct alignas(64) InactiveBatch {
  static constexpr int rows = 4;
  // The fourth: how much further apart along the normal than without impulses, at least.
  float normal[4 * rows];
  float weight[4 * rows];  // by vertex
  std::int32_t vertex[4 * rows];
  std::int32_t first_part = 0, last_part = 0;
};

// As RigidTerm.
struct alignas(16) RowRigidTerm {
  float arm[4];
  float weight;
  std::int32_t row;          // of the batch
  std::int32_t body;         // index
  std::int32_t translation, rotation;  // indices of displacements
};

struct alignas(16) RowBody {
  float inverse_mass[4];
  float inverse_inertia[3][4];  // by column
};

struct PgsProblem {
  RowBatch* batches;
  const RowRigidTerm* parts;
  const RowBody* bodies;
  // By all impulses. The first one is what nothing moves; RowBatch::vertices others come next,
  // which nobody reads.
  Float4* displacement;
};

struct SweepChange {
  float largest = 0;  // displacement that an impulse's change alone makes, squared
  float energy = 0;
  // Along what led from the end of the last sweep to this one's; negative where it turned back.
  float restart_test = 0;
};

struct PgsKernels {
  const char* name;
  // Projected Gauss-Seidel on the batches that are named.
  SweepChange (*sweep)(const PgsProblem& problem, const std::int32_t* batches, int count);
  // By how much the row lacks most that lacks any, in units of length.
  float (*most_left)(const PgsProblem& problem, int batches);
  // Of the waiting rows those that lack something, as 4 * batch + row; returns how many. `node_of`:
  // index of the displacement, by vertex.
  int (*lacking)(const PgsProblem& problem, const std::int32_t* node_of,
                 const InactiveBatch* waiting, int batches, std::int32_t* rows);
  // Of the first `count` displacements, at the end of a sweep: goes on by a part of what it has
  // moved since the end of the last one, and notes where it ended.
  void (*extrapolate)(float part, Float4* now, Float4* last, int count);
  // What the impulses that the batch has do to the displacements.
  void (*push)(const PgsProblem& problem, int batch);
};

// The best that this processor runs, or those of the named set ("baseline", "avx2", "avx512"); null
// where the processor lacks it.
const PgsKernels* best_pgs_kernels();
const PgsKernels* pgs_kernels(const char* name);

}  // namespace lazyccd::bullet
