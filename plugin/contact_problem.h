// The rows of a step as one problem: impulses along the normals that are never negative, and
// friction within Coulomb's cone, so that no gap is narrower at the end than its row allows.
//
// Projected Gauss-Seidel over the rows in their order, accelerated by nonlinear conjugate
// gradients: Silcowitz-Hansen, Niebe and Erleben 2010, "A nonsmooth nonlinear conjugate gradient
// method for interactive contact force problems". Plain sweeps carry the weight of a stack by one
// layer a sweep, and what they leave undone shows as creep.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "contact_row.h"
#include "motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ContactProblem {
 public:
  // Which displacement it is about: the one with velocity, or the one that opens gaps without.
  enum class Of { motion, opening };

  // Starts from the impulses that the rows have.
  ContactProblem(Of of, const std::vector<ContactRow>& rows, const Motion& motion);

  // At most `sweeps`, four times as many of what meets slowly, a fifth of opening; fewer where they
  // change nothing any more that could be seen.
  void solve(int sweeps);

  // The impulses, and what they make of the motion (not rounded).
  void write(std::vector<ContactRow>& rows, Motion& motion) const;

 private:
  struct Row {
    Eigen::Vector3d moved;   // metres, without impulses: of one side against the other
    Eigen::Vector3d normal;  // along it at least `least`
    double least, friction, response, sliding_response;
    std::array<int, 4> node;                 // in displacement_
    std::array<double, 4> weight, mobility;  // mobility: weight over mass
    int body;                                // index in Motion::rigid, or -1
    double body_weight;
    Eigen::Vector3d arm;
  };
  struct Impulse {
    double normal = 0;  // kg m
    Eigen::Vector3d tangential = Eigen::Vector3d::Zero();

    bool is_zero() const { return normal == 0 && tangential.isZero(0); }
  };
  struct Change {
    double largest = 0;  // metres
    double energy = 0;   // kg m^2
  };

  Eigen::Vector3d moved(const Row& row) const;
  void push(const Row& row, const Eigen::Vector3d& impulse);
  Change sweep();
  int turn_of(int body) const { return first_body_ + 2 * body + 1; }
  int shift_of(int body) const { return first_body_ + 2 * body; }

  Of of_;
  double seconds_;
  const std::vector<RigidMotion>& bodies_;
  std::vector<Row> rows_;
  std::vector<Impulse> impulses_;
  std::vector<std::int32_t> vertex_;  // by node
  int first_body_;
  // Metres, of the nodes; then shift and turn (radians) of each rigid body. The first node is what
  // no impulse moves.
  std::vector<Eigen::Vector3d> displacement_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
