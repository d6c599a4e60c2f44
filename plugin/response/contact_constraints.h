// The contacts of a step as inequalities on the end positions, solved together.
//
// Each row is a half-space: gap_end = sum_i w_i n.x_i >= target, with target <= gap_start. n is the
// normal of the contact, and w_i are its weights (sum zero). So the start satisfies every row. The
// solver projects Bullet's motion onto these half-spaces in the mass metric, that is, with the
// least change of momentum. Since the start is inside, the projection cannot gain kinetic energy,
// even if the iteration stops early: each Gauss-Seidel update raises the dual function of the
// projection. This requires that a row with an impulse is never removed during a step.
//
// Impulses act on nodes in the ratio w_i / mass_i and on a rigid body at the contact point. They
// add no momentum, whatever the masses are. Coulomb's friction is a tangential impulse of at most
// the coefficient times the normal one, which stops the sliding if that is enough. In the rigid
// world it takes at least a fraction of the sliding speed, as Bullet's (SlidingFriction).
#pragma once

#include <array>
#include <vector>

#include "contact/contact_row.h"
#include "contact/last_impulses.h"
#include "contact/pair_surfaces.h"
#include "contact/row_list.h"
#include "motion/motion.h"
#include "solver/contact_solver.h"
#include "solver/row_islands.h"
#include "util/matrix.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Vector from one side of the contact to the other at the end of the step, metres, as the row
/// models it: linear in the solved motion, without split impulses.
Vector3d gap_vector_at_end(const ContactRow& row, const Motion& motion);

/// What the row of a link did in the last step.
struct LastLinkImpulse {
  std::int32_t body, link;               ///< as in LinkLimit
  std::array<std::int32_t, 2> vertices;  ///< as in LinkLimit
  Vector3d impulse;  ///< on its second vertex towards the first one; unit as in ContactRow
};

/// The rows of a step and their impulses.
class ContactConstraints {
 public:
  /// `surfaces` must outlive this object. `position_correction`: as in SolverOptions.
  ContactConstraints(const PairSurfaces& surfaces, double position_correction,
                     const Threads& threads = Threads(1))
      : surfaces_(surfaces),
        position_correction_(position_correction),
        threads_(threads),
        solver_(ContactSolver::Target::motion, threads),
        split_solver_(ContactSolver::Target::split_impulse, threads) {}

  /// Starts a step without rows. Remembers the impulses of the last step.
  void begin_step();
  /// Drops all rows, as when a step is solved again. Remembered impulses stay.
  void clear_rows();
  /// Drops all rows, and gives remembered impulses the new indices of bodies and vertices.
  void renumber(const Renumbering& numbers);
  /// Drops all rows and remembered impulses.
  void forget();
  LastImpulses& last_impulses() { return last_impulses_; }
  /// Warm start: gives rows the impulses of the last step if their pair was in contact in it as
  /// well. A resting contact needs the same impulses again. This may raise the kinetic energy; the
  /// caller must check that.
  void warm_start();
  /// Sets all impulses of the selected islands to zero, and resets their motion to the predicted
  /// one.
  void cold_start(Motion& motion);
  /// Replaces the rows by near contacts, as RowList::take(). To be called before rows are added.
  void take_near_contacts(const NearContacts& near, const Motion& motion);
  /// Adds rows for contacts that the detector found; `contacts` must be sorted. A pair that has a
  /// row with an impulse keeps it and gets another row. Returns false if no impulse can act on any
  /// of the new rows.
  bool add(const std::vector<Contact>& contacts, const Motion& motion);
  /// Adds rows of vertices that are inside of bodies; `contacts` must be sorted. Each row moves its
  /// vertex out at `speed`, m/s, or at six times its depth a second if that is more.
  void add_penetrations(const std::vector<Contact>& contacts, double speed, const Motion& motion);
  /// Adds rows of links, with their impulses. `links` must be sorted by body and link, none twice.
  void add_links(Span<const LinkLimit> links, const Motion& motion);
  /// Impulses of the links of the last step, sorted by body and link.
  const std::vector<LastLinkImpulse>& last_link_impulses() const { return last_link_impulses_; }
  /// Number of links whose rows have an impulse.
  std::int64_t count_pulling_links() const;
  /// active_rows(), and then the rows of links that have an impulse. Valid as active_rows().
  const std::vector<const ContactRow*>& loaded_rows();
  /// Limits the target gap to `fraction` of the thickness, for rows that have a side of infinite
  /// mass and that `motion` violates: in those selected islands in which anything of infinite mass
  /// moves. If things of infinite mass close in on each other, there may be no room for all gaps.
  /// The limit is a fraction of the thickness, not of the present gap, which would shrink to
  /// nothing over many steps.
  void narrow_gaps(double fraction, const Motion& motion);
  /// Solves the selected islands for impulses and then for split impulses, and sets the ends of
  /// everything in contact there. `sweeps`: as in ContactSolver::solve().
  void solve(Motion& motion, int sweeps);
  /// The two halves of solve(). The second one follows the first one, or several of them.
  void solve_impulses(Motion& motion, int sweeps, ContactSolver::Manner manner);
  /// The first half again, in islands that it solved last. Since then nothing may have changed but
  /// nodes that links have moved.
  void solve_impulses_again(Motion& motion, int sweeps);
  void solve_split_impulses(Motion& motion, int sweeps);

  /// Islands of the present rows. All are selected when rows have changed.
  RowIslands& islands(const Motion& motion);

  /// Number of sweeps of the solver in this step.
  int sweep_count() const { return sweep_count_; }

  RowList& rows() { return rows_; }
  /// Rows of all contacts of which at least one row acted, without links, sorted by contact, so
  /// that the rows of a pair are adjacent. Valid until the next call that changes rows.
  const std::vector<const ContactRow*>& active_rows();

 private:
  /// As RowList::add().
  template <class Make>
  void add_rows(Span<const Contact> contacts, const Motion& motion, const Make& make);

  void take_link_impulses();
  /// Calls visit(row) for each row of a link that has an impulse, in their order.
  template <class Visit>
  void for_each_pulling_link(const Visit& visit) const;
  /// The rows of active_rows() among [first, last), which begins and ends with whole pairs.
  void find_active_rows(std::size_t first, std::size_t last,
                        std::vector<const ContactRow*>& found) const;
  /// Pairs of bodies of which a row has an impulse, the smaller index first; sorted. Not in islands
  /// in which anything of infinite mass moves: energy is not kept there in any case, and narrow
  /// gaps need all the room that they get.
  ScratchVector<BodyPair> find_pressed_pairs(const Motion& motion);
  void narrow_gap(ContactRow& row, double fraction, const Motion& motion);
  /// By island: whether a body in its contacts has prescribed motion.
  ScratchVector<char> find_prescribed_motion(const Motion& motion);
  /// The rest of solve_impulses(), once the problems are set up.
  void solve_set_up(Motion& motion, int sweeps);

  // A row that starts with an impulse of the last step.
  struct WarmStart {
    std::size_t row;
    const LastImpulses::Pair* last;
    bool is_made;
  };

  const PairSurfaces& surfaces_;
  double position_correction_;
  Threads threads_;
  RowList rows_;
  bool has_links_ = false;                      // whether any row is that of a link
  std::vector<const ContactRow*> active_rows_;  // result of active_rows()
  bool active_rows_are_current_ = false;
  // Scratch memory of active_rows() and warm_start(), by part of their work.
  std::vector<std::vector<const ContactRow*>> active_parts_;
  std::vector<const ContactRow*> loaded_rows_;  // result of loaded_rows() if there are links
  std::vector<std::vector<WarmStart>> warm_starts_;
  LastImpulses last_impulses_;
  std::vector<LastLinkImpulse> last_link_impulses_;
  RowIslands islands_;
  bool islands_are_current_ = false;  // false: rows changed since
  int sweep_count_ = 0;               // in this step
  ContactSolver solver_, split_solver_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
