// Keeps links from being stretched by contacts. A pass over the links moves a node against the mass
// of the node alone and remembers nothing, so passes cannot hold what is much heavier. A link that
// is stretched beyond the limit becomes a row among those of the contacts, with an impulse that is
// kept. Source: Provot 1995, "Deformation constraints in a mass-spring model to describe rigid
// cloth behavior".
#pragma once

#include <algorithm>
#include <cstdint>

#include "contact/near_contacts.h"
#include "motion/motion.h"
#include "response/contact_constraints.h"
#include "response/links/link_rounds.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class StrainLimit {
 public:
  /// `limit`: SolverOptions::strain_limit.
  explicit StrainLimit(double limit) : limit_(limit > 0 ? std::max(1.0, limit) : 0) {}

  bool is_on() const { return limit_ > 0; }

  /// Adds rows of the links that pulled in the last step, with their impulses, if a contact of
  /// `near` may act on their body. Call before the first solve.
  void warm_start(const NearContacts& near, const LinkSolver& links,
                  ContactConstraints& constraints, const Motion& motion);
  /// Adds rows of the links of these soft bodies that are too long in the solved motion, and solves
  /// again, until there are none or the rounds are over. A link may be as long as the limit, or as
  /// it was at the start of the step if that is longer. `sweeps`: as in ContactSolver::solve().
  /// Response calls it after LinkRounds, and after the first contacts that were not near. Called
  /// after all of these, links and contacts would undo each other (tests/long/stretch.md).
  void hold(Span<const std::int32_t> bodies, const LinkSolver& links, int sweeps,
            ContactConstraints& constraints, Motion& motion);

 private:
  /// The links of the body that are longer than `tolerance` allows in the solved motion, a multiple
  /// of the length that they may have.
  void find_stretched(std::int32_t body, const LinkSolver& links, double tolerance,
                      const Motion& motion, ScratchVector<LinkLimit>& stretched) const;

  double limit_;  // of the length, as a multiple of the rest length; 0: none
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
