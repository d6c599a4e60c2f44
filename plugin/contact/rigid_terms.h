// Terms of dynamic rigid bodies in a contact: of their own vertices, and of soft vertices that are
// anchored to them.
#pragma once

#include <array>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"
#include "motion/motion.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Part of a contact that moves with one dynamic rigid body.
struct RigidTerm {
  int body;       ///< index in Motion::rigid
  double weight;  ///< sum of the weights of its vertices
  /// sum_i w_i (x_i - centre) at the start of the step, metres. Of a ball only the part along the
  /// normal: its triangles lie inside of it, and a force along its normal does not turn it.
  Vector3d arm;

  /// Displacement of the weighted sum of the vertices, metres, if the body moves by `translation`
  /// (metres) and `rotation` (rotation vector, radians).
  Vector3d displacement(const Vector3d& translation, const Vector3d& rotation) const {
    return weight * translation + rotation.cross(arm);
  }
  /// An impulse on the weighted sum as an impulse and an angular impulse on the centre of the body.
  Vector6d wrench_of(const Vector3d& impulse) const {
    return stacked(weight * impulse, arm.cross(impulse));
  }
  /// Adds the effect of an impulse (kg m) on the weighted sum to the motion of the body.
  void apply_impulse(const RigidMotion& rigid, const Vector3d& impulse, Vector3d& translation,
                     Vector3d& rotation) const {
    if (rigid.supported_mobility) {
      const Vector6d moved = *rigid.supported_mobility * wrench_of(impulse);
      translation += moved.head<3>();
      rotation += moved.tail<3>();
      return;
    }
    translation += weight * rigid.inverse_mass.cwiseProduct(impulse);
    rotation += rigid.inverse_inertia * arm.cross(impulse);
  }
  /// Displacement of the weighted sum per impulse on it, 1/kg, if the body leaves its supports.
  /// With them it is no larger.
  Matrix3d mobility(const Motion& motion) const;
  /// The same while the body is held at its supports.
  Matrix3d held_mobility(const Motion& motion) const;
};

/// The rigid terms of one contact, at most four, in the order of its vertices. Computed when needed
/// instead of being stored with every contact, as most contacts have none.
class RigidTerms {
 public:
  RigidTerms(const Contact& contact, const std::array<double, 4>& weights, const Motion& motion) {
    const int a = motion.rigid_of_body()[contact.body_a];
    const int obstacle = a >= 0 ? a : motion.rigid_of_body()[contact.body_b];
    if ((obstacle >= 0 && motion.rigid()[obstacle].is_movable()) || !motion.anchored().empty())
      find(obstacle, contact, weights, motion);
  }

  const RigidTerm* begin() const { return terms_.data(); }
  const RigidTerm* end() const { return terms_.data() + count_; }

 private:
  void find(int obstacle, const Contact& contact, const std::array<double, 4>& weights,
            const Motion& motion);
  void add(int body, double weight, const Vector3d& start, const Motion& motion);

  int count_ = 0;
  std::array<RigidTerm, 4> terms_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
