// Solves links and contacts in turn. Bullet solves the links of a step before the contacts are
// known. Contacts alone would move the nodes that touch, and leave the links to them too short.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "contact/renumbering.h"
#include "motion/motion.h"
#include "response/contact_constraints.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The links of the soft bodies.
struct LinkSolver {
  /// When the links of a body are solved again.
  enum class Again {
    never,
    /// After an impact: the links that contacts leave too short would throw the body back.
    after_impact,
    /// Under load too: nodes carry the pressure of a body to the contacts, and only links hold
    /// them together. If they are solved before the contacts alone, the body is pressed flat.
    under_load
  };

  std::function<Again(std::int32_t body)> again;
  /// Moves Motion::solved of these soft bodies (indices of bodies) by more passes over their links,
  /// and adds that to Motion::link_displacement. Returns the largest displacement, metres.
  std::function<double(const std::vector<std::int32_t>& bodies, Motion& motion)> solve;

  /// False: there are no such links.
  explicit operator bool() const { return static_cast<bool>(solve); }
};

/// Decides in each step which links are solved again, and does that.
class LinkRounds {
 public:
  /// Starts a step. Remembers the loads of the last one.
  void begin_step();
  /// Call if the indices of bodies change.
  void renumber(const Renumbering& numbers);
  void forget();

  /// `constraints` must be solved. `sweeps`: as in ContactSolver::solve().
  void run(const LinkSolver& links, int sweeps, ContactConstraints& constraints, Motion& motion);

  /// Soft bodies whose links were solved in the last run().
  const std::vector<std::int32_t>& bodies() const { return bodies_; }
  /// Call before a step is solved, also if it is solved without run().
  void clear_bodies() { bodies_.clear(); }

 private:
  using Bodies = std::vector<std::int32_t>;

  /// Sums up the normal forces on each body. Returns the soft bodies whose sum rises.
  Bodies find_rising_loads(const std::vector<const ContactRow*>& rows, const Motion& motion);
  /// Solves the links of these bodies and the contacts of their islands, up to `rounds` times.
  void solve_in_turn(const Bodies& bodies, int rounds, ContactSolver::Friction friction,
                     const LinkSolver& links, int sweeps, ContactConstraints& constraints,
                     Motion& motion);

  std::vector<double> loads_, last_loads_;  // by body: normal forces before the rounds, N
  Bodies bodies_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
