// Solver for the rows of a step: finds impulses along the normals that are never negative, and
// friction impulses within Coulomb's cone, so that no gap at the end is narrower than its row
// allows.
//
// The method is projected Gauss-Seidel with Nesterov's acceleration: after each sweep, the last
// change is extrapolated. Mazhar et al. 2015, "Using Nesterov's method to accelerate multibody
// dynamics with friction and contact", use it with Jacobi's method. Plain sweeps carry the weight
// of a stack by one layer per sweep, and the rest error shows as creep. The extrapolation is
// restarted if it points away from the solution (O'Donoghue and Candes 2015, "Adaptive restart for
// accelerated gradient schemes", section 3.2). Friction is not the gradient of any function, so the
// extrapolation is also restarted if the changes of the sweeps grow.
//
// The iteration runs in single precision, in units taken from the problem itself, so that it does
// not depend on the units of the scene. Its result only decides how large the impulses are. Their
// effect on the motion is computed in double precision, and conserves momentum to that precision.
//
// Most rows never act (active set method). Rows that start without an impulse stay out of the
// problem and are only checked from time to time. A row that is violated is added to the problem.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "contact/contact_row.h"
#include "contact/row_list.h"
#include "motion/motion.h"
#include "response/pgs_kernels.h"
#include "response/row_batches.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Solves one problem at a time: set_up(), solve(), write(). Memory is kept for the next problem.
class ContactSolver {
 public:
  /// Quantity that the impulses change. motion: the solved motion, and velocities follow it.
  /// split_impulse: only positions, to restore gaps.
  enum class Target { motion, split_impulse };

  /// Sets up the problem of a target, starting from the impulses that the rows have. `rows` and
  /// `motion` must not change until write(). The problem of split impulses must follow that of the
  /// motion, with the same rows.
  void set_up(Target target, RowList& rows, const Motion& motion);

  /// Largest displacement along a normal that impulses must add to those that the rows have,
  /// metres.
  double largest_violation() const { return max_violation_; }

  /// Runs the sweeps. `sweeps`: normal limit. The limit is 4 x `sweeps` if contacts approach slowly
  /// or rest, and `sweeps` / 5 for split impulses. Stops earlier once sweeps change nothing
  /// visible.
  void solve(int sweeps);

  /// Writes the impulses to the rows and their effect to `motion`. On entry `motion` must contain
  /// the effect of the impulses that the rows had at set_up(). Sets the ends of the soft vertices
  /// that it moves; the caller calls Motion::apply_response() for rigid bodies and multibodies.
  void write(Motion& motion);

 private:
  // A change of displacement per step below this speed is invisible, m/s.
  static constexpr double min_speed = 3e-5;

  using Indices = std::vector<std::int32_t>;

  struct RowNeed {
    double displacement;          // along the normal, that the impulses must add, metres
    bool may_need_split = false;  // the row may need a split impulse
  };

  bool has_impulse(const ContactRow& row) const {
    return for_split_impulse_ ? row.split_impulse != 0 : row.has_impulse();
  }
  /// Computes the needs of all rows, or of those that may need a split impulse, and divides the
  /// rows by whether they have an impulse. Returns false if no row needs anything.
  bool classify_rows(bool only_may_need_split);
  /// Fills inactive_ with the rows that have no impulse.
  void set_up_inactive();
  /// Sets violated_ to the violated rows of inactive_, as 4 * batch + lane.
  void find_violated();
  /// Calls find_violated() and adds these rows to the problem. Returns false if there are none.
  bool activate_violated();
  /// Adds rows to the problem, in new batches.
  void activate(const Indices& indices);
  /// Sets up bodies_ and couplings_.
  void set_up_bodies();
  /// Index of the displacement that stands for everything that an impulse on the body moves.
  std::int32_t slot_of(int body) const;
  void fill(RowBatch& batch, int lane, const ContactRow& row, const RowNeed& need);
  void add_rigid_terms(const Contact& contact, const std::array<double, 4>& weights, int lane);
  std::int32_t first_node() const {
    return 1 + RowBatch::vertices + 2 * static_cast<std::int32_t>(bodies_.size());
  }
  std::size_t batch_count() const { return row_batches_.batches().size(); }
  bool is_batch_active(std::int32_t batch) const;
  /// Bounds the sliding friction of these batches for the next sweep: rows that carry a load get
  /// their fraction. `is_final`: rows that have had it get the present size of their friction.
  void set_sliding(const Indices& swept, bool may_end);
  /// Moves the impulses and displacements of these batches on by `factor` times their last
  /// change.
  void extrapolate(float factor, const Indices& swept);
  PgsProblem problem() {
    return {batches_.data(), rigid_terms_.data(), bodies_.data(), couplings_.data(),
            displacement_.data()};
  }

  // Chosen per object: a constant of the .cpp file may not be initialized yet when a world is
  // stepped during static initialization.
  const PgsKernels* kernels_ = best_pgs_kernels();
  RowList* rows_ = nullptr;
  const Motion* motion_ = nullptr;
  // From one problem to the next only memory and RowNeed::may_need_split are kept.
  bool for_split_impulse_ = false;
  double length_unit_ = 1, mass_unit_ = 1;  // metres, kg
  // Largest values over the rows: need in metres, squared displacement in m^2, normal mass in
  // kg.
  double max_need_ = 0, max_move_squared_ = 0, max_normal_mass_ = 0;
  double max_violation_ = 0;    // at set_up(), metres
  std::vector<RowNeed> needs_;  // by row of the list
  RowBatches row_batches_;
  std::vector<RowBatch> batches_;        // batch_count() of them are in use
  std::vector<std::int32_t> batch_end_;  // by batch: one past its last displacement
  std::vector<InactiveBatch> inactive_;
  // Rows of the list: those that start with an impulse; the others; the violated ones of the
  // others.
  Indices initially_active_, inactive_rows_, violated_;
  std::vector<RowRigidTerm> rigid_terms_;
  std::vector<RowBody> bodies_;
  std::vector<RowCoupling> couplings_;
  // Displacements, in this order: index 0 for everything immovable; dummies that are never read;
  // translation and rotation of each rigid body; nodes, in the order in which rows brought the soft
  // vertices. last_displacement_: at the end of the sweep before.
  std::vector<Float4> displacement_, last_displacement_;
  Indices vertex_of_node_;  // soft vertex, by node
  Indices node_of_;  // by soft vertex: index of its displacement, or 0; a last 0 for all others
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
