// The momentum equation of the deformable world: velocities after damping forces, which are
// implicit, with Bullet's constraints as Lagrange multipliers. Solved as in
// btDeformableBodySolver::solveDeformableConstraints() (Bullet 3.24) for the explicit scheme with
// the KKT preconditioner, Bullet's default. The result is Bullet's, to the bit but for the sign of
// zeros, on any number of threads, if Bullet is built without fused multiply-adds. Contacts that
// are expected change it (expected_contacts.h): with them, each island of bodies is solved by
// itself.
#pragma once

#include <BulletSoftBody/btDeformableBackwardEulerObjective.h>

#include <array>
#include <vector>

#include "bodies/body_forces.h"
#include "bodies/conjugate_residual.h"
#include "bodies/equation_islands.h"
#include "bodies/expected_contacts.h"
#include "bodies/side_by_side.h"
#include "bodies/spring_damping.h"
#include "lazyccd/bullet/precision.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class MomentumEquation {
 public:
  /// Changes `dv`, the velocity changes of all nodes, to the solution. `residual` is zero before,
  /// and then the right hand side. Returns false if it did nothing, because a part of the
  /// objective is not Bullet's own class. `dt`: the time step, seconds. `lost`: bodies, by index in
  /// the objective, that are solved apart, so that they do not decide when all others have
  /// converged. Bodies that are not finite are not solved.
  bool solve(btDeformableBackwardEulerObjective& objective, btScalar dt, int max_iterations,
             btScalar tolerance, const SideBySide& bodies, Span<const int> lost,
             ExpectedContacts& contacts, VectorStack& residual, VectorStack& dv);

 private:
  // A force that damps. One of springs is a matrix; others add their part body by body, or all at
  // once if a force is of no known class.
  struct Term {
    int index;  // in the objective's list
    btDeformableLagrangianForce* force;
    const SpringDamping* springs;
  };

  bool read(btDeformableBackwardEulerObjective& objective);
  void add_right_hand_side(btScalar dt, VectorStack& residual) const;
  void find_preconditioner();
  void find_apart(Span<const int> lost);
  bool is_finite(const EquationIsland& island) const;
  void solve_with(ExpectedContacts& contacts, int max_iterations, btScalar tolerance);
  // Solves for an island. `index`: its number in `contacts`. `penalties`: memory for them, if
  // several threads work on the island; null: one thread does.
  void solve_island(const EquationIsland& island, std::size_t index, ExpectedContacts& contacts,
                    int max_iterations, btScalar tolerance, const ParallelFor& parallel_for,
                    ContactPenalties* penalties);
  ScratchVector<EquationIsland> find_islands(const ExpectedContacts& contacts) const;
  // Computes b = A x for the unknowns of an island.
  void multiply(const EquationIsland& island, const VectorStack& x, VectorStack& b,
                const ParallelFor& parallel_for) const;
  void add_damping(const Term& term, const EquationIsland& island, const VectorStack& x,
                   VectorStack& b, const ParallelFor& parallel_for) const;
  void multiply_multipliers(const EquationIsland& island, const VectorStack& x,
                            VectorStack& b) const;

  // Of this solve().
  btDeformableBackwardEulerObjective* objective_ = nullptr;
  const SideBySide* side_by_side_ = nullptr;
  int nodes_ = 0;
  EquationIsland all_;
  std::vector<Term> terms_;
  BodyForces body_forces_;
  bool has_body_forces_ = false;
  bool is_divisible_ = false;              // the forces act on one body each
  std::vector<char> is_finite_;            // of each body: positions and velocities
  std::vector<std::array<int, 2>> apart_;  // bodies solved apart, each as a pair with itself

  SpringProbe probe_;
  std::vector<SpringDamping> springs_;
  std::vector<btScalar> mass_, inverse_mass_;  // kg; zero for nodes that are pinned
  VectorStack velocity_, preconditioner_, right_hand_side_, solution_;
  VectorStack plain_right_hand_side_;  // without contacts
  ConjugateResidual conjugate_residual_;
  ContactPenalties penalties_;  // of the island that all threads solve
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
