// Solves links and contacts in turn. With LazyCCD, Bullet's links are solved before the contacts of
// the step are known. Contacts alone would move the nodes that touch, and leave the links to them
// too short or too long.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "contact/renumbering.h"
#include "lazyccd/span.h"
#include "motion/motion.h"
#include "response/contact_constraints.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// The links of the soft bodies.
struct LinkSolver {
  struct Link {
    std::array<std::int32_t, 2> vertices;
    double rest_length;  ///< metres
  };

  /// When the links of a body are solved again.
  enum class Again {
    never,
    /// Where contacts move a node by much of an edge. There links are stretched most.
    where_pushed,
    /// That, and under a weight: a rigid body that is much heavier than the nodes that carry it. If
    /// links are solved before the contacts alone, one solution of them must move these nodes by as
    /// much as the step moves the weight. The links stretch until that is enough.
    under_weight,
    /// In each step with contacts, in rounds that follow the body's position iterations, nearly as
    /// Bullet solves them. Where links are solved before the contacts alone, the nodes that touch
    /// stop and the others go on, through the flat shape: tetrahedra turn inside out and stay so.
    /// Not in the grip of dynamic bodies, which do not press by their weight.
    in_contact
  };

  std::function<Again(std::int32_t body)> again;
  /// The links of a soft body but those that only resist bending. Valid until the response begins
  /// anew, or the step ends.
  std::function<Span<const Link>(std::int32_t body)> links;
  /// Position iterations of a body.
  std::function<int(std::int32_t body)> iterations;
  /// Moves Motion::solved of these soft bodies (indices of bodies) by one more position iteration
  /// of their links, and adds that to Motion::link_displacement. Motion::end stays. Returns false,
  /// and moves nothing, if no node would move by `least`, metres.
  std::function<bool(Span<const std::int32_t> bodies, double least, Motion& motion)> solve;

  /// False: there are no such links.
  explicit operator bool() const { return static_cast<bool>(solve); }
};

/// Decides in each step which links are solved again, and does that.
class LinkRounds {
 public:
  /// Starts a step of `dt` seconds.
  void begin_step(double dt) { time_ += dt; }
  /// Call if the indices of bodies change.
  void renumber(const Renumbering& numbers);
  /// Forgets how far weights pushed in the last step.
  void forget();

  /// `constraints` must be solved. `sweeps`: as in ContactSolver::solve().
  void run(const LinkSolver& links, int sweeps, ContactConstraints& constraints, Motion& motion);

  /// Soft bodies whose links were solved in the last run().
  const std::vector<std::int32_t>& bodies() const { return bodies_; }
  /// Call before a step is solved, also if it is solved without run().
  void clear_bodies() { bodies_.clear(); }

 private:
  using Bodies = std::vector<std::int32_t>;

  // What a body has carried. Times are on the clock of the steps, seconds.
  struct Load {
    double push = 0;           // NodePushes::by_weights after the last rounds
    double weighed_until = 0;  // until then the links of the body are solved again under weights
    double apart_until = 0;    // until then they are not: it was pushed apart from another body
  };
  // How many rounds a body takes.
  struct BodyRounds {
    std::int32_t body;
    int rounds;
  };
  /// Solves the links of these bodies and the contacts of their islands in turn.
  void solve_in_turn(Span<const BodyRounds> turns, const LinkSolver& links, int sweeps,
                     ContactConstraints& constraints, Motion& motion);
  double time_ = 0;          // sum of the steps, seconds
  std::vector<Load> loads_;  // by body
  Bodies bodies_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
