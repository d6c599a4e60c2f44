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
  using Vector = Eigen::Vector4f;  // the last one is zero
  using Indices = std::vector<std::int32_t>;

  struct Row {
    Vector normal;
    Vector sliding;                         // without impulses
    std::array<float, 4> weight, mobility;  // mobility: weight over mass
    std::array<std::int32_t, 4> node = {};  // in displacement_
    float need;  // how much further apart along the normal than without impulses, at least
    float friction, response, compliance, sliding_response, sliding_compliance;
    std::int32_t first_part, last_part;  // in parts_, one past the last
  };
  // As RigidPart.
  struct Part {
    Vector arm;
    float weight;
    std::int32_t body;  // index in bodies_
  };
  struct Impulse {
    Vector across = Vector::Zero();
    float along = 0;

    bool is_zero() const { return along == 0 && across.isZero(0); }
  };
  struct Body {
    Vector inverse_mass;
    Eigen::Matrix4f inverse_inertia;
  };
  struct Change {
    float largest = 0;  // displacement that an impulse's change alone makes, squared
    float energy = 0;
    // Along what led from the end of the last sweep to this one's; negative where it turned back.
    float onward = 0;
  };

  Row make_row(const ContactRow& row, const Eigen::Vector3d& move, const Motion& motion);
  void push(const Row& row, const Impulse& impulse);
  Vector moved(const Row& row) const;  // by all impulses
  // How much further apart the row is to come that lacks most, in units of length.
  double most_left() const;
  Change sweep(const Indices& which);
  void carry_on(float momentum, const Indices& which);
  std::int32_t shift_of(std::int32_t body) const { return first_body_ + 2 * body; }
  std::int32_t turn_of(std::int32_t body) const { return first_body_ + 2 * body + 1; }

  bool opening_;
  double seconds_;
  double length_ = 1, mass_ = 1;    // units, m and kg
  double approach_ = 0;             // metres: the most that a row needs
  std::vector<std::size_t> order_;  // of the given rows
  std::vector<Row> rows_;
  std::vector<Part> parts_;
  std::vector<Body> bodies_;
  std::vector<Impulse> impulses_, last_;  // last_: at the end of the sweep before
  std::int32_t first_body_ = 1;
  // Of the nodes; then shift and turn of each rigid body. The first node is what no impulse moves.
  std::vector<Vector> displacement_, last_displacement_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
