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
#include <vector>

#include "response/contact_solver.h"
#include "contact/contact_row.h"
#include "contact/pair_surfaces.h"
#include "motion/motion.h"
#include "contact/row_list.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Vector between the two sides of a contact at the end of the step, in the linear model of it.
Eigen::Vector3d separation(const ContactRow& row, const Motion& motion);

class ContactConstraints {
 public:
  // The surfaces must outlive it. `position_correction`: as in SolverOptions.
  ContactConstraints(const PairSurfaces& surfaces, double position_correction)
      : surfaces_(surfaces), position_correction_(position_correction) {}

  // Starts a step without rows.
  void begin_step();
  // To be called where the indices of bodies, vertices or faces change.
  void forget();
  // Starts from the impulses of the last step, where a pair was in contact in it too: what rests
  // needs the same ones again. It may raise the kinetic energy, which is for the caller to see.
  void start_warm();
  // Takes all impulses back, and what they made of the motion.
  void start_cold(Motion& motion);
  // Takes what comes near each other in the step, as RowList has it, where there are no rows yet.
  void take(const SpeculativePairs& near, const Motion& motion);
  // Adds rows for contacts that touch, which come sorted. A pair that is in contact again gets a
  // further row. False where nothing in them gives way.
  bool add(const std::vector<Contact>& contacts, const Motion& motion);
  // Rows with what has infinite mass that the motion does not fulfil ask for this part of their
  // thickness at most: where such things close in on each other there may be no room for all of
  // them. Not of their gaps, which many steps would then close to nothing.
  void narrow(double part, const Motion& motion);
  // Solves the rows, then places the ends of everything in contact.
  void relax(Motion& motion, int sweeps);

  RowList& rows() { return rows_; }
  // Those of the pairs of which any row acted, sorted by contact: those of a pair beside each
  // other. Valid until anything is done to the rows.
  const std::vector<const ContactRow*>& is_active();

 private:
  // What a pair needed in the last step.
  struct Remembered {
    Contact contact;
    Eigen::Vector3d impulse;  // kg m
  };

  const PairSurfaces& surfaces_;
  double position_correction_;
  RowList rows_;
  std::vector<ContactRow> merged_;        // only while rows are added
  std::vector<const ContactRow*> acted_;  // empty where it is not known
  std::vector<Remembered> remembered_;    // sorted by contact
  ContactSolver problem_;                // the last one
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
