// Kernels of the contact solver (projected Gauss-Seidel), four rows at a time. They are compiled
// once for each instruction set (plugin/isa); the results are the same. The place of a row in its
// batch is its lane.
//
// Unless said otherwise, four floats hold x, y, z and a zero.
#pragma once

#include <cstdint>

namespace lazyccd::bullet {

/// Vector of three floats, and a zero.
struct alignas(16) Float4 {
  float x[4];
};

/// Four rows that can be solved at the same time: they move no node in common. They may move the
/// same rigid body, if their masses take that into account. A missing row is zero, but for
/// scatter_node.
struct alignas(64) RowBatch {
  static constexpr int lanes = 4, vertices = 4 * lanes;
  float normal[4 * lanes];
  /// Tangential relative displacement without impulses. Instead of the zero: what bounds the
  /// friction impulse besides Coulomb's cone. Positive: this fraction of what would hold. Negative:
  /// an impulse of this size.
  float tangent_move[4 * lanes];
  float weight[4 * lanes],  ///< by vertex
      mobility[4 * lanes];  ///< by vertex: weight / mass
  /// By row: displacement along the normal that impulses must add (need), normal mass, friction
  /// coefficient, tangent mass.
  float terms[4 * lanes];
  float impulse[4 * lanes],     ///< by row: tangent impulse x, y, z, then the normal impulse
      last_impulse[4 * lanes];  ///< impulses one sweep before
  float compliance[4 * lanes];  ///< displacement per impulse, in the order of `impulse`
  float sliding[4 * lanes];     ///< by row: three zeros, and ContactRow::sliding_fraction
  /// Index of the displacement, by vertex. node: to load from; 0 if immovable. scatter_node: to
  /// add to. It is like `node`, but immovable vertices get dummies of their own, so that stores
  /// never alias and none waits for another. No two threads share a dummy.
  std::int32_t node[vertices], scatter_node[vertices];
  /// Its rigid terms; those of the same body follow each other. last_term: one past the last.
  std::int32_t first_term = 0, last_term = 0;
  bool slides = false;     ///< some row has a sliding fraction
  bool was_active = true;  ///< for the solver: when it last looked, the batch was active
};

/// Rows without an impulse, which get none until they are violated. Unlike the rows of a RowBatch
/// they may move things in common. A missing row is zero.
struct alignas(64) InactiveBatch {
  static constexpr int lanes = 4;
  /// x, y, z, and the displacement along the normal that impulses must add (need).
  float normal[4 * lanes];
  float weight[4 * lanes];         ///< by vertex
  std::int32_t vertex[4 * lanes];  ///< index in node_of (see find_violated)
  std::int32_t first_term = 0, last_term = 0;
};

/// RigidTerm in the units of the problem.
struct alignas(16) RowRigidTerm {
  float arm[4];
  float weight;
  std::int32_t lane;                   ///< of its row in the batch, 0..3
  std::int32_t body;                   ///< index in PgsProblem::bodies
  std::int32_t translation, rotation;  ///< indices of displacements
};

/// Inverse mass and inertia of a rigid body, in the units of the problem. For a link of a multibody
/// both are zero, and its couplings hold instead.
struct alignas(16) RowBody {
  float inverse_mass[4];
  float inverse_inertia[3][4];                         ///< by column
  std::int32_t first_coupling = 0, last_coupling = 0;  ///< last_coupling: one past the last
  /// Index of a coupling that holds instead of mass and inertia, as supports hold the body; or -1.
  std::int32_t held = -1;
};

/// How an impulse on one link of a multibody moves a link of the same multibody, or a body itself:
/// translation and rotation by x, y, z of the impulse and x, y, z of the angular impulse on the
/// centre.
struct alignas(16) RowCoupling {
  float translation_by[6][4], rotation_by[6][4];
  std::int32_t translation, rotation;  ///< indices of displacements; 0: of the body itself
};

/// The arrays that the kernels work on.
struct PgsProblem {
  RowBatch* batches;
  const RowRigidTerm* rigid_terms;
  const RowBody* bodies;
  const RowCoupling* couplings;
  /// Displacements that all impulses together make. The first one is zero and stands for everything
  /// immovable. Dummies are written but never read.
  Float4* displacement;
};

/// What a sweep does besides solving each row once.
struct SweepMode {
  /// Nesterov's extrapolation: before it is solved, each impulse goes on by this multiple of its
  /// change in the sweep before. The displacements must have gone on by the same multiple.
  float extrapolation = 0;
  /// False: rows that carry a load may have their sliding fraction of friction in the next sweep.
  /// True: rows that have had it get the present size of their friction as their bound.
  bool fixes_sliding = false;
  const RowBatch* next = nullptr;  ///< batches that are swept afterwards, to fetch early; or null
};

/// Measures of what one sweep changed.
struct SweepChange {
  /// Largest squared displacement that the change of one impulse makes by itself.
  float largest = 0;
  float size = 0;  ///< sum of compliance * (change of impulse)^2
  /// Dot product of the changes of this sweep with the way from the end of the last sweep to the
  /// end of this one. Negative: the iteration turned back, restart the extrapolation.
  float restart_test = 0;
};

/// The kernels for one instruction set.
struct PgsKernels {
  const char* name;
  /// One projected Gauss-Seidel sweep over the `count` batches with these indices.
  SweepChange (*sweep)(const PgsProblem& problem, const std::int32_t* batches, int count,
                       const SweepMode& mode);
  /// Largest violation over all rows of the first `batches` batches, in the length unit; 0 if there
  /// is none.
  float (*max_violation)(const PgsProblem& problem, int batches);
  /// Finds the violated rows among inactive ones. Writes them to `rows` as 4 * batch + lane and
  /// returns their number. `node_of`: by vertex, the index of its displacement.
  int (*find_violated)(const PgsProblem& problem, const std::int32_t* node_of,
                       const InactiveBatch* inactive, int batches, std::int32_t* rows);
  /// Nesterov's extrapolation of `count` displacements at the end of a sweep. Moves each one
  /// further by `factor` times its change since the last sweep, and stores the old value in `last`.
  void (*extrapolate)(float factor, Float4* now, Float4* last, int count);
  /// Adds the effect of the present impulses of one batch to the displacements.
  void (*apply_impulses)(const PgsProblem& problem, int batch);
};

/// Best kernels that this processor can run.
const PgsKernels* best_pgs_kernels();
/// Kernels of the named instruction set ("baseline", "avx2", "avx512"); null if this processor
/// cannot run it.
const PgsKernels* pgs_kernels(const char* name);

}  // namespace lazyccd::bullet
