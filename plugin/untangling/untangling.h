// Removes intersections that a scene begins with: intersections of soft bodies with each other,
// with themselves and with rigid bodies. Continuous collision detection preserves these
// intersections, because a vertex on the wrong side may not pass back either.
//
// If the intersecting edges cut a component off a surface, the edges move back through the faces.
// The component on the wrong side is the one inside of another body's closed surface; in all other
// cases it is the smaller component. If the edges cut nothing off, each edge moves so that the line
// in which the surfaces intersect becomes shorter. The method is from Volino and Magnenat-Thalmann
// 2006, "Resolving surface collisions through intersection contour minimization".
//
// Vertices inside of rigid bodies (penetrations.h) are moved out by the contact solver instead, and
// the bodies with them.
//
// Contacts of these pairs that would stop this motion are allowed to pass. All other contacts stop
// motion as usual.
//
// Groups of bodies (pair_progress.h) are moved apart independently of each other.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <utility>

#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "untangling/intersections.h"
#include "untangling/pair_progress.h"
#include "untangling/penetrations.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ClosedSurfaces;

class Untangling {
 public:
  Untangling();
  ~Untangling();

  /// Starts to untangle a scene that intersects.
  void start() { is_in_progress_ = true; }
  /// False if no intersections are left but those that were given up.
  bool is_in_progress() const { return is_in_progress_; }
  /// See PairProgress::set_ids().
  void set_ids(std::vector<int> ids) { progress_.set_ids(std::move(ids)); }
  /// Says that a body is new or was put elsewhere. What was given up with it is tried again.
  void place(std::int32_t body) { progress_.place(body); }
  /// True if one of the two was placed in this untangling. What is inside of the other, and was
  /// there before, stays there.
  bool is_placed(std::int32_t a, std::int32_t b) const { return progress_.is_placed(a, b); }
  /// Ends the untangling if nothing is in progress.
  void finish();

  /// What intersects at the start of a step.
  struct Found {
    Intersections intersections;
    Penetrations penetrations;
    bool empty() const { return intersections.pairs.empty() && penetrations.contacts.empty(); }
  };

  /// Begins a step. `found` has indices into `topology` and `edges` of this step.
  void begin_step(const Found& found, const Topology& topology, Span<const Edge> edges,
                  const Motion& motion);
  /// Reads what intersects again, when the indices change within the step.
  void read(const Found& found, const Topology& topology, Span<const Edge> edges,
            const Motion& motion) {
    read(found, topology, edges, motion, 0);
  }
  /// Begins a step in which nothing is pushed, and forgets the pushes of the last step.
  void skip_step();
  /// Moves the ends of soft vertices by at most `distance`, metres, without changing velocities.
  void push(double distance, Motion& motion) const;
  bool pushes() const { return !pushes_.empty() || !penetrations_.contacts.empty(); }
  /// What is inside of obstacles; the response moves it out of them.
  const std::vector<Contact>& penetrations() const { return penetrations_.contacts; }
  /// Pairs of bodies that are moved apart: smaller index first, sorted.
  const std::vector<BodyPair>& pairs() const { return pairs_; }
  bool is_pushed(std::int32_t vertex) const { return pushes_.count(vertex) > 0; }
  /// True if the body is moved apart from another one or from itself.
  bool moves_apart(std::int32_t body) const;
  bool allows_any_pass() const { return !directions_.empty() || !penetrations_.contacts.empty(); }
  /// True if the contact would stop a motion that untangling needs.
  bool allows_pass(const Contact& contact, const Motion& motion) const;

 private:
  using Vector = Vector3d;

  void read(const Found& found, const Topology& topology, Span<const Edge> edges,
            const Motion& motion, double seconds);
  /// Takes the penetrations of the pairs that are moved apart.
  void take_penetrations(const Penetrations& found, const Topology& topology);
  /// Sets Push::longest: each group moves by the same distance, whatever the pushes in others are.
  void find_longest_pushes(const PairProgress::Groups& groups, const Topology& topology);
  /// Adds the push of one intersection. `direction`: of the edge relative to the face.
  void add(const Edge& edge, const Face& face, const Vector& direction, const Motion& motion);
  bool comes_out(const Contact& contact, const Vector& normal, const Motion& motion) const;
  bool penetrates(const Contact& contact, const Motion& motion) const;

  struct Push {
    Vector displacement = Vector::Zero();
    double longest = 1;  ///< norm of the longest one in its group, at least 1
  };

  std::map<std::int32_t, Push> pushes_;  ///< by soft vertex
  /// Direction of the first vertex relative to the second, for pairs of a vertex of an edge and a
  /// vertex of a face, in both orders.
  std::map<std::pair<std::int32_t, std::int32_t>, Vector> directions_;
  std::unique_ptr<const ClosedSurfaces> closed_surfaces_;
  Penetrations penetrations_;
  std::vector<BodyPair> pairs_;
  PairProgress progress_;
  bool is_in_progress_ = false;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
