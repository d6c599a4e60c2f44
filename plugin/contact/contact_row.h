// A contact as an inequality on the end of the step.
#pragma once

#include <Eigen/Core>
#include <array>

#include "contact/pair_surfaces.h"
#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct ContactRow {
  Contact contact;
  Eigen::Vector3d normal;
  std::array<double, 4> weights;
  // Gaps in metres: at the start of the step; the one that impulses keep, which is never wider; and
  // the one that is opened without velocity.
  double start_gap, target_gap, corrected_gap;
  double normal_impulse;      // kg m: the sum of what changed the solved motion, along the normal
  double split_impulse;      // the same of the opening
  bool is_movable;        // false: no impulse acts, as where what is driven meets what is driven
  bool touched = false;  // not only near
  Eigen::Vector3d tangent_impulse;  // as `impulse`, across the normal
  // 1 / sum_i w_i^2 / mass_i, kg, rigid bodies' shares included: along the normal, and at most
  // across it.
  double normal_mass, tangent_mass;
  double friction;

  bool is_active() const { return normal_impulse != 0 || split_impulse != 0 || touched; }
};

// What there is to know of a row that nothing has acted on yet, to tell whether anything will.
struct SpeculativeContact {
  // Metres, of how far one side moves against the other in the step as Bullet has it: its square,
  // and how much further along the normal it is to be, at least.
  double move_squared, need;
  double normal_mass;  // as the row has it
  bool is_movable;   // as the row has it
  bool may_open;    // its gap may need to be opened
};

// Metres: that of the surfaces, but neighbours in one cloth are closer than that by themselves. It
// depends on the points in contact alone, not on which pair of features stands for them.
double thickness_of(const Contact& contact, const Motion& motion, double of_surfaces);

// Makes the row of a contact, without impulses. `thickness`, metres, is the contact's own;
// `recovery` as in SolverOptions. The end of the motion is of no matter.
void make_row(const Contact& contact, double thickness, double friction, double position_correction,
              const Motion& motion, ContactRow& row);

/// Makes the rows of one step. What it is made with must outlive it.
class RowFactory {
 public:
  RowFactory(const PairSurfaces& surfaces, double position_correction, const Motion& motion)
      : surfaces_(&surfaces), position_correction_(position_correction), motion_(&motion) {}

  void make(const Contact& contact, ContactRow& row) const;

 private:
  const PairSurfaces* surfaces_;
  double position_correction_;  // as in SolverOptions
  const Motion* motion_;
};

// Of a row that was just made; `move`, metres, is how far one side moves against the other in the
// step as Bullet has it.
SpeculativeContact speculative_contact_of(const ContactRow& row, const Eigen::Vector3d& move);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
