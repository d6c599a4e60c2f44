// The rows of a step as one problem: impulses along the normals that are never negative, and
// friction within Coulomb's cone, so that no gap is narrower at the end than its row allows.
//
// Projected Gauss-Seidel with Nesterov's momentum, as Mazhar et al. 2015, "Using Nesterov's method
// to accelerate multibody dynamics with friction and contact", have it for Jacobi's. Plain sweeps
// carry the weight of a stack by one layer a sweep, and what they leave undone shows as creep. The
// momentum is given up where it leads away (O'Donoghue and Candes 2015, "Adaptive restart for
// accelerated gradient schemes", section 3.2) and, since friction is the gradient of nothing, where
// the sweeps' changes grow.
//
// The iteration is in single precision, in units of the problem's own, so that it depends on no
// one's units; its result only says how large the impulses are. What they do to the motion is
// computed in double, and keeps momentum to that.
//
// Most rows never act. Those that had no impulse wait, and are only looked at now and then: what
// lacks something comes into the problem.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "contact/contact_row.h"
#include "motion/motion.h"
#include "contact/row_list.h"
#include "response/row_batches.h"
#include "response/pgs_kernels.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ContactSolver {
 public:
  // Which displacement it is about: the one with velocity, or the one that opens gaps without.
  enum class Of { motion, opening };

  // Starts from the impulses that the rows have. Rows and motion are to stay as they are until
  // write(). The problem of opening comes after that of the motion, of the same rows.
  void set_up(Of of, RowList& rows, const Motion& motion);

  // At most `sweeps`, four times as many of what meets slowly, a fifth of opening; fewer where they
  // change nothing any more that could be seen.
  void solve(int sweeps);

  // The impulses, and what they make of the motion, which is to have what the rows' impulses up to
  // now made of it. Places the ends of what they move, but for rigid bodies.
  void write(Motion& motion);

 private:
  using Indices = std::vector<std::int32_t>;

  struct Demand {
    // How much further apart along the normal the impulses of the problem are to bring the row, at
    // least, metres.
    double need;
    bool may_open = false;  // its gap may need to be opened
  };

  double impulse_of(const ContactRow& row) const { return opening_ ? row.split_impulse : row.normal_impulse; }
  bool find_demands(bool only_to_open);
  void set_up_inactive();
  // What waits and lacks something; and takes it into the problem. True where there is any.
  void find_violated();
  bool activate_violated();
  void activate(const Indices& rows);
  void fill(RowBatch& batch, int row, const ContactRow& given, const Demand& demand);
  void add_parts(const Contact& contact, const std::array<double, 4>& weights, int row);
  std::int32_t first_node() const {
    return 1 + RowBatch::vertices + 2 * static_cast<std::int32_t>(bodies_.size());
  }
  std::size_t count() const { return row_batches_.groups().size(); }  // of batches
  bool is_batch_active(std::int32_t batch) const;
  void extrapolate(float momentum, const Indices& which);
  PgsProblem swept() { return {batches_.data(), parts_.data(), bodies_.data(), now_.data()}; }

  // Chosen here, for worlds may be stepped before a constant of this file would be there.
  const PgsKernels* kernels_ = best_pgs_kernels();
  RowList* rows_ = nullptr;
  const Motion* motion_ = nullptr;
  // Kept from problem to problem is only the memory, and Demand::may_open.
  bool opening_ = false;
  double length_ = 1, mass_ = 1;  // units, m and kg
  // Of the demands: metres, the most that a row needs; metres, squared; kg.
  double approach_ = 0, longest_squared_ = 0, heaviest_ = 0;
  std::vector<Demand> demands_;  // by given row
  RowBatches row_batches_;
  std::vector<RowBatch> batches_;  // and more, unused
  std::vector<std::int32_t> end_;  // by batch: one past the last displacement
  std::vector<InactiveBatch> inactive_;
  // Of given rows: those with an impulse at first; the others; of these, those that lack something.
  Indices begun_, inactive_rows_, violated_;
  std::vector<RowRigidTerm> parts_;
  std::vector<RowBody> bodies_;
  // Displacements: what no impulse moves, and what nobody reads; then shift and turn of each rigid
  // body; then the nodes, soft vertices in the order in which rows brought them. last_: at the end
  // of the sweep before.
  std::vector<Float4> now_, last_;
  Indices vertices_;  // by node
  Indices node_of_;   // by soft vertex, and none: index of the displacement, or 0
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
