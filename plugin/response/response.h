// Contact response: changes the end of a step until nothing passes through anything.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "motion/articulated_motion.h"
#include "motion/motion.h"
#include "response/contact_constraints.h"
#include "response/impact_zones.h"
#include "response/islands.h"
#include "response/links/link_rounds.h"
#include "response/links/strain_limit.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Runs the response of each step and keeps impulses for the warm start of the next step.
class Response {
 public:
  /// Returns the contacts of the motion from `start` to `end`, sorted, without those that must not
  /// be resolved.
  using Detect = std::function<std::vector<Contact>(const Positions& start, const Positions& end)>;

  Response(const SolverOptions& options, const PairSurfaces& surfaces,
           const Threads& threads = Threads(1))
      : options_(options),
        threads_(threads),
        constraints_(surfaces, options.position_correction, threads),
        strain_limit_(options.strain_limit) {}

  /// Starts a step. Remembers the impulses of the last one.
  void begin_step(double dt);
  /// Call if the indices of bodies or vertices change. Remembered impulses get the new ones.
  void renumber(const Renumbering& numbers);

  /// Changes the end of `motion` until `detect_all` finds no contact that can be resolved.
  /// `near`: pairs that come near each other; the selected ones are solved before the first
  /// detection. Three methods follow: impulses; rigid impact zones; zones held at the start of the
  /// step. The first two end after so many rounds as the options say. What cannot be resolved, as
  /// between things that are driven, counts as StepStats::unresolved. Afterwards
  /// motion.velocity_change holds what must be added to the velocities.
  /// `penetrations`: vertices inside of bodies, see find_penetrations(). `links` may be empty. May
  /// be called several times in a step: each call begins with the impulses of the last step.
  void run(const NearContacts& near, const std::vector<Contact>& penetrations,
           const Detect& detect_all, const LinkSolver& links, Motion& motion, StepStats& stats);

  /// Rows of the pairs that acted in the last run(), sorted by contact. Valid until the next call
  /// that changes something.
  const std::vector<const ContactRow*>& active_rows() { return constraints_.active_rows(); }

  /// Islands of the rows of the last run(), with its motion.
  const RowIslands& islands(const Motion& motion) { return constraints_.islands(motion); }
  /// Impact zones of the last run(); null if it needed none.
  ImpactZones* zones() { return zones_ ? &*zones_ : nullptr; }

  LastImpulses& last_impulses() { return constraints_.last_impulses(); }
  /// Drops the impulses of the last step.
  void forget();

 private:
  /// Holds the links of all soft bodies of the selected islands that are in contact.
  void hold_links_in_contact(const LinkSolver& links, Motion& motion);
  /// Solves the near contacts that were selected: with a warm start, or without if that raises the
  /// kinetic energy.
  void solve_speculative(const NearContacts& near, const std::vector<Contact>& penetrations,
                         const LinkSolver& links, Motion& motion);
  /// Solves again for the bodies that the first solve pulls off their supports.
  void let_bodies_leave_supports(Motion& motion);
  /// Finds which joints their limits and motors hold, and solves again where that changes.
  void hold_joints(Motion& motion);
  using UpdateHolds = std::function<ArticulatedMotion::Changes(ArticulatedMotion&)>;
  /// Updates what holds joints, and solves again where that changes. Returns whether it does.
  bool update_holds(const UpdateHolds& update, Motion& motion);
  /// After links were solved in turn with contacts: motors give way where they do not fit to that,
  /// and contacts are solved again there.
  void weaken_motors(Motion& motion);
  /// Resolves contacts that impulses leave: rigid impact zones first, then holds.
  void resolve_with_impact_zones(std::vector<Contact> contacts, const Detect& detect,
                                 Motion& motion, StepStats& stats);
  /// Computes the velocity changes.
  void finish(Motion& motion, StepStats& stats);

  SolverOptions options_;
  Threads threads_;
  ContactConstraints constraints_;
  LinkRounds link_rounds_;
  StrainLimit strain_limit_;
  Islands islands_;
  std::optional<ImpactZones> zones_;  // kept to be drawn
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
