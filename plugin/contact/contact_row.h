// One contact row: the contact as an inequality on the positions at the end of the step.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "contact/pair_surfaces.h"
#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Row of the contact solver: the gap sum_i w_i n.x_i at the end of the step must not be narrower
/// than target_gap. n is the normal, w_i are the weights of the four vertices (their sum is zero).
///
/// Impulses act on positions. Their unit is kg m = N s x dt, whereas StepContact has N s.
///
/// To widen a gap that carries a load takes work: the load times the distance. So while two bodies
/// press on each other, position correction restores gaps to loaded_gap only.
struct ContactRow {
  ContactRow() {}  // leaves the fields to make_row()

  Contact contact;
  Vector3d normal;
  std::array<double, 4> weights;
  double start_gap,       ///< gap at the start of the step, metres
      target_gap,         ///< gap that impulses keep, metres; not wider than max(0, start_gap)
      corrected_gap,      ///< gap that split impulses restore without velocity, metres
      loaded_gap;         ///< gap that the contact had when its load came, metres
  double normal_impulse;  ///< total impulse on the solved motion along the normal, >= 0
  double split_impulse;   ///< total split impulse along the normal, >= 0
  /// False: no impulse acts. Either none can move the contact points along the normal (both sides
  /// are prescribed, or the axes are locked), or the near contact was deselected
  /// (NearContactSelector, Untangling).
  bool can_act;
  bool touched = false;  ///< true: the detector found a contact, not only a speculative one
  /// Friction impulse on the solved motion. With a sliding fraction, a contact whose load has ended
  /// during the sweeps may keep some.
  Vector3d tangent_impulse;
  /// Effective masses, kg: 1 / sum_i (w_i^2 / mass_i) with the terms of rigid bodies, 0 if no
  /// impulse can move the contact points. Limited to 256 times the mass of the lightest node.
  double normal_mass,  ///< along the normal
      tangent_mass;    ///< lower bound over all tangent directions
  double friction;     ///< Coulomb's coefficient
  /// Fraction of the sliding that friction takes at least, 0 to 1 (SlidingFriction::per_step()).
  double sliding_fraction;

  /// Total impulse on the solved motion.
  Vector3d impulse() const { return normal_impulse * normal + tangent_impulse; }
  bool has_impulse() const { return normal_impulse != 0 || !tangent_impulse.isZero(); }
  /// Whether an impulse acted or the detector found the contact.
  bool acted() const { return has_impulse() || split_impulse != 0 || touched; }
};

/// The two bodies of a contact, the smaller index first.
inline BodyPair ordered_bodies(const Contact& contact) {
  return {std::min(contact.body_a, contact.body_b), std::max(contact.body_a, contact.body_b)};
}

/// A link that must not get longer than `longest`. Its row has the form of a contact of its two
/// vertices; the direction is from the second to the first one.
struct LinkLimit {
  std::int32_t body, link;  ///< soft body, and index of the link there
  std::array<std::int32_t, 2> vertices;
  Vector3d direction;  ///< of unit length
  double longest;      ///< metres
  double impulse;      ///< that the row starts with, >= 0; unit as in ContactRow
};

/// The contact that stands for a link in lists of rows. Links of a body are in their own order,
/// before the contacts of its edges with each other.
Contact contact_of(const LinkLimit& limit);
inline bool is_of_link(const Contact& contact) { return contact.primitive_a < 0; }
/// Index of the link of such a contact.
inline std::int32_t link_of(const Contact& contact) {
  return contact.primitive_a - std::numeric_limits<std::int32_t>::min();
}

/// Summary of a row and of its violation by a given motion. The first detection computes it for
/// every near contact without making the row; the contact solver computes it for rows that are
/// made.
struct RowEstimate {
  double move_squared,  ///< squared relative displacement of the sides in the motion, m^2
      need;  ///< target_gap minus the gap at the end of the motion, metres; <= 0: no violation
  double normal_mass;   ///< as in ContactRow
  bool can_act;         ///< as in ContactRow
  bool may_need_split;  ///< the row may need a split impulse: corrected_gap > target_gap
};

/// Returns the thickness of a contact, metres. Between two bodies it is `surface_thickness`. Within
/// one body it is at most half the weighted length of the shortest edges at the contact points, the
/// smaller one of both sides: neighbours in a cloth are closer than the thickness by themselves.
/// Depends on the contact points alone, not on which pair of features represents them.
double thickness_of(const Contact& contact, const Motion& motion, double surface_thickness);

/// Share of a missing gap that position correction restores in a step of `dt` seconds, from 0 to 1.
inline double corrected_share(double position_correction, double dt) {
  return std::min(1.0, position_correction * dt);
}

/// Makes the row of a contact, without impulses and without friction. `thickness`: of this contact,
/// metres; `position_correction`: as in SolverOptions. Does not use the end of the motion.
void make_row(const Contact& contact, double thickness, double position_correction,
              const Motion& motion, ContactRow& row);

/// Makes the rows of one step. The constructor arguments must outlive it.
class RowFactory {
 public:
  RowFactory(const PairSurfaces& surfaces, double position_correction, const Motion& motion)
      : surfaces_(&surfaces), position_correction_(position_correction), motion_(&motion) {}

  /// Makes the row of a contact, without impulses, with the thickness and friction of its bodies.
  void make(const Contact& contact, ContactRow& row) const;
  /// Makes the row of a vertex that is inside of a body (find_penetrations()): it must not get
  /// deeper, and a split impulse moves it out by `distance`, metres. No friction.
  void make_penetration(const Contact& contact, double distance, ContactRow& row) const;
  /// Makes the row of a link, without friction.
  void make_link(const LinkLimit& limit, ContactRow& row) const;
  const Motion& motion() const { return *motion_; }

 private:
  const PairSurfaces* surfaces_;
  double position_correction_;  // as in SolverOptions
  const Motion* motion_;
};

/// Summarises a row. `move`: displacement of one side relative to the other in the motion, metres.
RowEstimate estimate_row(const ContactRow& row, const Vector3d& move);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
