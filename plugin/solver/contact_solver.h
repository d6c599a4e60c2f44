// Solver for the rows of a step: finds impulses along the normals that are never negative, and
// friction impulses within Coulomb's cone (or ContactRow::sliding_fraction), so that no gap at the
// end is narrower than its row allows.
//
// The method is projected Gauss-Seidel with Nesterov's acceleration: after each sweep, the last
// change is extrapolated. Mazhar et al. 2015, "Using Nesterov's method to accelerate multibody
// dynamics with friction and contact", use it with Jacobi's method. Plain sweeps carry the weight
// of a stack by one layer per sweep, and the rest error shows as creep. The extrapolation is
// restarted if it points away from the solution (O'Donoghue and Candes 2015, "Adaptive restart for
// accelerated gradient schemes", section 3.2). Friction is not the gradient of any function, so the
// extrapolation is also restarted if the changes of the sweeps grow.
//
// Displacements count from the motion without impulses and without links that were solved again. So
// a problem can be solved further after links have moved nodes (go_on()): rows, blocks and impulses
// stay, and only displacements begin anew, from those of the links.
//
// Rows are solved in blocks of neighbours (row_block.h). The blocks of a stage are solved on
// several threads. What two of them move is split between them (shared_slots.h), and joined again
// after the stage. Rows that come later, because they are violated, make a stage of their own.
// Neither blocks nor their order depend on the number of threads, so the result is the same to the
// bit.
//
// The rows of a batch split the mass of a rigid body or multibody in the same way: each takes it
// for as many times as light as rows move it, and the body moves by the sum of their impulses.
//
// The iteration runs in single precision, in units taken from the problem itself, so that it does
// not depend on the units of the scene. Its result only decides how large the impulses are. Their
// effect on the motion is computed in double precision, and conserves momentum to that precision.
//
// Each island (row_islands.h) is a problem of its own: with its own tolerance, number of sweeps and
// extrapolation. The sweeps of all islands run side by side until each has ended. So the result of
// an island is the same to the bit, whatever happens elsewhere.
//
// Most rows never act (active set method). Rows that start without an impulse stay out of the
// problem and are only checked from time to time. A row that is violated is added to the problem.
#pragma once

#include <cstdint>
#include <vector>

#include "contact/contact_row.h"
#include "contact/rigid_terms.h"
#include "contact/row_list.h"
#include "lazyccd/threads.h"
#include "motion/motion.h"
#include "solver/pgs_kernels.h"
#include "solver/row_batches.h"
#include "solver/row_block.h"
#include "solver/row_islands.h"
#include "solver/shared_slots.h"
#include "util/box.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Solves the problems of some islands at a time: set_up(), solve(), write(), and as often as links
/// move nodes again: go_on(), solve(), write(). Memory is kept for the next time.
class ContactSolver {
 public:
  /// Quantity that the impulses change. motion: the solved motion, and velocities follow it.
  /// split_impulse: only positions, to restore gaps.
  enum class Target { motion, split_impulse };

  ContactSolver(Target target, const Threads& threads)
      : for_split_impulse_(target == Target::split_impulse), threads_(threads) {}

  /// How a problem is solved.
  enum class Manner {
    /// Until sweeps change nothing visible.
    full,
    /// The same, for a problem that was solved and has gained rows. Where friction is a fraction of
    /// the sliding, it keeps the size that it has, even if its load ends: what has moved against it
    /// since would be thrown aside. Rows without friction so far get their fraction.
    again,
    /// As `again`, as a round in turn with links: few sweeps, and fewer if the first one changes
    /// little, because the next round goes on from the impulses.
    round
  };

  /// Sets up the problems of the selected islands, starting from the impulses that the rows have.
  /// `rows`, `islands` and `motion` must not change until write(). The problems of split impulses
  /// must follow those of the motion, with the same rows and islands. `pressed`: for split
  /// impulses, the pairs of bodies that press on each other, as find_pressed_pairs().
  void set_up(RowList& rows, const RowIslands& islands, const Motion& motion,
              Manner manner = Manner::full, Span<const BodyPair> pressed = {});
  /// Goes on from the impulses of the last write(). The selected islands must be among those of
  /// set_up(). Of all else that it took, only what links move may have changed: Motion::solved and
  /// Motion::link_displacement.
  void go_on();

  /// Runs the sweeps and returns their number. `sweeps`: normal limit. The limit is 4 x `sweeps` if
  /// contacts approach slowly or rest, `sweeps` / 5 for split impulses, and `sweeps` / 10 in a
  /// round. Stops earlier once sweeps change nothing visible.
  int solve(int sweeps);

  /// Marks rows without an impulse that the last solution violates: they may need a split impulse.
  /// Call before the problems of split impulses are set up.
  void mark_violated();

  /// Writes the impulses to the rows and their effect to `motion`. On entry `motion` must contain
  /// the effect of the impulses that the rows had at set_up(). Sets the ends of the soft vertices
  /// that it moves; the caller calls Motion::apply_response() for rigid bodies and multibodies.
  void write(Motion& motion);

 private:
  class NewBlocks;
  class Sweeps;

  using Indices = std::vector<std::int32_t>;

  // Largest values over rows: need in metres, squared displacement in m^2, normal mass in kg.
  struct Largest {
    double need = 0, move_squared = 0, normal_mass = 0;
    void include(const Largest& other);
  };
  // The problem of an island.
  struct Problem {
    bool is_set_up = false;  // its island was selected in set_up()
    bool is_open = false;    // set up, and some row needs something
    bool is_pushed = false;  // besides the contacts: by motors of a multibody, or by links
    bool any_active = false;
    Largest largest;
    double length_unit = 1, mass_unit = 1;  // metres, kg
    // At the start: largest displacement along a normal that impulses must add, metres.
    double max_violation = 0;
  };
  // Some rows of an island, in the order of the list.
  struct RowChunk {
    static constexpr std::size_t max_rows = 1024;
    std::size_t island = 0;
    Span<const std::int32_t> rows;
    Largest largest;
    Indices active, inactive;  // rows that start with an impulse; the others
    std::vector<InactiveBatch> batches;
    std::vector<RowRigidTerm> terms;  // of `batches`
    Indices violated;                 // among `inactive`, as 4 * batch + lane
  };
  // Rows, island by island.
  struct RowsByIsland {
    struct Part {
      std::size_t island, first, last;  // of `rows`
    };
    Indices rows;
    std::vector<Part> parts;

    void clear();
    void add(std::size_t island, std::int32_t row);
  };
  // Blocks that are solved at the same time. Stages follow each other.
  struct Stage {
    std::size_t first = 0, last = 0;  // of blocks_
    Indices swept;                    // blocks in the present sweep
    SharedSlots shared;
  };
  // Memory of a thread.
  struct Scratch {
    RowBatches batches;
    Indices copy_of;  // by slot: the copy that the present block has, or 0
  };

  /// Without links that were solved again, as the estimates of rows that are not made.
  RowEstimate estimate(const ContactRow& row) const;
  /// Whether the estimate of a row that is not made holds: no body of it has turned since.
  bool is_current(const Contact& contact) const;
  bool has_impulse(const ContactRow& row) const {
    return for_split_impulse_ ? row.split_impulse != 0 : row.has_impulse();
  }
  /// Runs each(item, worker) for items below `count`, on several threads if the problem is large.
  template <class Each>
  void for_each(std::size_t count, const Each& each) const;
  /// Runs each(block, worker) for all blocks, stage by stage, and join(shared, grain) for all
  /// grains of what the blocks of a stage share, when they are done.
  template <class Each, class Join>
  void for_each_block_by_stage(const Each& each, const Join& join);
  /// Threads for items of a phase: one if there is little to do.
  const Threads& threads_for(std::size_t items) const;
  /// Threads for the blocks: one if there is little to do.
  const Threads& threads_of_blocks() const;

  /// Divides the rows of the selected islands into chunks.
  void make_chunks();
  /// Computes the needs of the rows of all open problems, or of those rows that may need a split
  /// impulse, and divides them by whether they have an impulse. Closes problems in which no row
  /// needs anything. Returns whether any is open.
  bool classify_rows(bool only_may_need_split);
  void classify(RowChunk& chunk, bool only_may_need_split);
  /// Displacements of all that blocks move begin anew, from what links and motors have moved.
  void restart_displacements();
  /// Whether all selected islands have a problem.
  bool are_set_up() const;
  /// Displacement of a soft vertex by links that were solved again.
  Float4 link_displacement(std::int32_t vertex, const Problem& problem) const;
  /// Whether no block has claimed this slot of a node.
  bool is_unclaimed(std::int32_t slot) const { return slot > 0 && vertex_of_[slot] < 0; }
  /// Gives slots to the nodes of a soft body that links have moved and no block moves.
  void give_slots_to_moved(std::int32_t body);
  /// Batches of a block begin anew, from their impulses and the present motion.
  void restart(RowBlock& block);
  /// Adds what impulses do to the displacements.
  void apply_impulses();
  /// Adds rows that are violated at the present displacements.
  void add_violated();
  /// Sets Problem::max_violation, by which set_limits() knows what rests.
  void find_max_violations();
  /// Adds new_rows_ to the problem.
  void add_blocks();
  bool is_selected(const RowBlock& block) const { return islands_->is_selected(block.island); }
  /// Makes the batches of the rows that have no impulse.
  void set_up_inactive(RowChunk& chunk);
  void find_violated(RowChunk& chunk);
  /// Takes the violated rows out of the chunks, as new_rows_.
  void take_violated();
  /// Makes the batches of a block, and its rows that are not made.
  void fill(RowBlock& block, Scratch& scratch);
  void fill(RowBlock& block, const RowBatches::Batch& rows, RowBatch& batch,
            const Indices& copy_of);
  /// `extra_normal`, `extra_tangent`: what the splitting of masses adds to the compliance, 1/kg.
  void fill(RowBatch& batch, int lane, const Problem& problem, const ContactRow& row,
            double extra_normal, double extra_tangent, double need, const Indices& copy_of) const;
  /// What bounds the friction of the rows besides Coulomb's cone, as `manner_` has it.
  void bound_sliding(RowBatch& batch) const;
  /// Sets bodies_ and couplings_.
  void set_up_bodies();
  /// Sets Problem::is_pushed.
  void find_pushed_islands();
  /// Links start where ArticulatedMotion::motor_impulse moves them.
  void set_motor_displacements();
  RowRigidTerm make_term(const RigidTerm& term, int lane) const;
  /// Sets scratch.copy_of to the copies of the block, or back to zeros.
  void map_copies(const RowBlock& block, Scratch& scratch) const;
  void unmap_copies(const RowBlock& block, Scratch& scratch) const;
  /// Sets the copies of the block to what is shared.
  void read_shared(const RowBlock& block);
  /// Joins the copies of some shared slots.
  void join(const SharedSlots& shared, const SharedSlots::Grain& grain);
  /// Writes the impulses of the block to the rows, and their effect on nodes and bodies.
  void write(const RowBlock& block, Motion& motion, Scratch& scratch);
  /// Adds what the blocks have done to some shared slots.
  void write(const SharedSlots& shared, const SharedSlots::Grain& grain, Motion& motion) const;
  /// The problem that moves a body of Motion::rigid; null if none does.
  const Problem* problem_of_rigid(std::size_t rigid) const {
    const std::int32_t island = islands_->of_rigid(rigid);
    return island < 0 ? nullptr : &problems_[island];
  }
  /// Whether impulses of the present problems can move a body of Motion::rigid.
  bool moves(std::size_t rigid) const {
    const std::int32_t island = islands_->of_rigid(rigid);
    return island >= 0 && islands_->is_selected(island);
  }
  /// The motion of a body that impulses of the target change.
  Vector3d& translation_of(RigidSolution& body) const;
  Vector3d& rotation_of(RigidSolution& body) const;
  std::int32_t displacement_count() const {
    return static_cast<std::int32_t>(displacement_.size());
  }
  PgsProblem problem_of(RowBlock& block) {
    return {block.batches.data(), block.terms.data(), bodies_.data(), couplings_.data(),
            displacement_.data()};
  }

  const bool for_split_impulse_;
  // Chosen per object: a constant of the .cpp file may not be initialized yet when a world is
  // stepped during static initialization.
  const PgsKernels* kernels_ = best_pgs_kernels();
  Threads threads_;
  Threads serial_{1};
  RowList* rows_ = nullptr;
  const RowIslands* islands_ = nullptr;
  const Motion* motion_ = nullptr;
  Span<const BodyPair> pressed_;  // in set_up() of split impulses
  Manner manner_ = Manner::full;
  bool has_rigid_terms_ = false;
  std::vector<Problem> problems_;  // by island
  // By row of the list: displacement along the normal that links and impulses must add, metres.
  std::vector<double> needs_;
  std::vector<RowChunk> chunks_;
  std::size_t chunk_count_ = 0;
  std::vector<RowBlock> blocks_;
  std::size_t block_count_ = 0, block_row_count_ = 0;
  std::vector<Stage> stages_;
  std::size_t stage_count_ = 0;
  RowsByIsland new_rows_;      // that come into the problem next
  std::vector<Box3d> places_;  // scratch memory of NewBlocks, as keys_
  std::vector<std::uint64_t> keys_;
  std::vector<Scratch> scratch_;  // by worker
  Indices sharers_;               // by slot: blocks of the last stage that move it
  Indices slot_scratch_;          // by slot: zeros, for SharedSlots
  Indices row_body_of_;           // by rigid body: index in bodies_ for the last stage
  std::vector<RowBody> bodies_;   // rigid bodies; then those that blocks of a stage share, split
  std::vector<RowCoupling> couplings_;
  // Displacements: index 0 for everything immovable; translation and rotation of each rigid body;
  // then nodes and what the blocks have of their own. Nodes are moved by links and impulses, bodies
  // by motors and impulses. last_displacement_: at the end of the sweep before.
  std::vector<Float4> displacement_, last_displacement_;
  Indices vertex_of_;  // by displacement: the soft vertex that a block moves, or -1
  Indices node_of_;    // by soft vertex: index of its displacement, or 0; a last 0 for all others
  // By displacement: what the impulses of a block do to its copy, metres and radians; for write().
  std::vector<Vector3d> written_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
