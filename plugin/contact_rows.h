// Contacts of a step as inequalities on the end positions, solved together.
//
// Each row is a cut: with the normal n and the weights w (sum zero) of a contact, the gap at the
// end of the step, sum_i w_i n.x_i, is to stay at a target that is never wider than the gap at the
// start. So the start fulfils every row, and the motion with the least change of momentum that
// fulfils them is a projection (in the metric of the masses) onto a convex set that holds the
// start: it cannot have more kinetic energy than the motion it came from, and since each
// Gauss-Seidel update raises the dual function of that projection, neither can what an unfinished
// iteration leaves. Rows are therefore only added in a step, and never taken back while they carry
// an impulse.
//
// Impulses act on nodes in the ratio w_i / mass_i and on a rigid body at the contact point: they
// add no momentum, whatever the masses. Friction is Coulomb's: a tangential impulse of at most the
// coefficient times the normal one, which stops the sliding where it can.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// What the bodies of a contact say about it.
struct PairSurface {
  double thickness;  // metres
  double friction;   // Coulomb's coefficient
};

struct ContactRow {
  Contact contact;
  std::array<double, 4> weights;
  Eigen::Vector3d normal;
  // Gaps in metres: the one that impulses keep, which is never wider than at the start of the step,
  // and the one that is opened without velocity.
  double kept_gap, opened_gap;
  // Metres by which the predicted motion narrows the gap, and by which it may.
  double approach, remaining;
  double friction;
  // 1 / sum_i w_i^2 / mass_i, kg, a rigid body's share included: along the normal, and at most
  // across it.
  double response, sliding_response;
  double impulse;              // kg m: the sum of what changed the solved motion, along the normal
  Eigen::Vector3d tangential;  // the same across it
  double opening;              // the same of the opening
  bool touched = false;        // not only near

  // The side of the contact that is a rigid body: index in Motion::rigid or -1, the sum of its
  // weights (1 or -1), and its lever arm: sum_i w_i (x_i - centre), metres.
  int rigid;
  double rigid_weight;
  Eigen::Vector3d arm;
};

class ContactRows {
 public:
  using Surface = std::function<PairSurface(std::int32_t body_a, std::int32_t body_b)>;

  // `recovery`: as in Options.
  ContactRows(Surface surface, double recovery)
      : surface_(std::move(surface)), recovery_(recovery) {}

  // Metres: that of the surfaces, but neighbours in one cloth are closer than that by themselves.
  static double thickness(const Contact& contact, const Motion& motion, double of_surfaces);

  // Starts a step without rows.
  void begin_step();
  // To be called where the indices of bodies, vertices or faces change.
  void forget();
  // Starts from the impulses of the last step, where a pair was in contact in it too: what rests
  // needs the same ones again. It may raise the kinetic energy, which is for the caller to see.
  void start_warm(Motion& motion);
  // Takes all impulses back.
  void start_cold(Motion& motion);
  // Adds rows for contacts, which come sorted. A pair that is in contact again gets a further row.
  // `touching`: these do not only come near each other.
  void add(const std::vector<Contact>& contacts, bool touching, const Motion& motion);
  // Projected Gauss-Seidel over the rows in their order, then the ends of everything in contact.
  void relax(Motion& motion, int sweeps);

  // Sorted by contact; those of a pair beside each other.
  const std::vector<ContactRow>& rows() const { return rows_; }

 private:
  // What a pair needed in the last step.
  struct Remembered {
    Contact contact;
    Eigen::Vector3d impulse;  // kg m
  };

  ContactRow make_row(const Contact& contact, const Motion& motion) const;

  Surface surface_;
  double recovery_;
  std::vector<ContactRow> rows_;
  std::vector<Remembered> remembered_;  // sorted by contact
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
