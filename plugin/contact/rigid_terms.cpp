#include "contact/rigid_terms.h"

#include <algorithm>

#include "motion/articulated_motion.h"
#include "util/matrix.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

Matrix3d RigidTerm::mobility(const Motion& motion) const {
  const RigidMotion& rigid = motion.rigid()[body];
  if (rigid.articulated >= 0) {
    const ArticulatedMotion& multibody = motion.articulated[rigid.articulated];
    // Limits and motors may let go of joints while contacts are solved; so rows have the larger
    // mobility.
    return multibody.free_mobility_of(multibody.link_of(body), weight, arm);
  }
  const Matrix3d lever = cross_matrix(arm);
  return weight * weight * diagonal_matrix(rigid.inverse_mass) +
         lever.transpose() * rigid.inverse_inertia * lever;
}

Matrix3d RigidTerm::held_mobility(const Motion& motion) const {
  const RigidMotion& rigid = motion.rigid()[body];
  if (!rigid.supported_mobility) return mobility(motion);
  Matrix3d result;
  for (int k = 0; k < 3; ++k) {
    Vector3d translation = Vector3d::Zero(), rotation = Vector3d::Zero();
    apply_impulse(rigid, Vector3d::Unit(k), translation, rotation);
    result.set_col(k, displacement(translation, rotation));
  }
  return result;
}

void RigidTerms::find(int obstacle, const Contact& contact, const std::array<double, 4>& weights,
                      const Motion& motion) {
  bool anchored_to_obstacle = false;
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    if (motion.is_free(v)) continue;
    const int body = motion.is_soft(v) ? motion.anchor_body_of(v) : obstacle;
    if (body >= 0 && motion.rigid()[body].is_movable())
      add(body, weights[i], motion.start_of(v), motion);
    anchored_to_obstacle = anchored_to_obstacle || (motion.is_soft(v) && body == obstacle);
  }
  if (obstacle < 0 || !motion.rigid()[obstacle].is_ball || anchored_to_obstacle) return;
  const Vector3d normal(contact.normal[0], contact.normal[1], contact.normal[2]);
  for (int i = 0; i < count_; ++i)
    if (terms_[i].body == obstacle) terms_[i].arm = normal.dot(terms_[i].arm) * normal;
}

void RigidTerms::add(int body, double weight, const Vector3d& start, const Motion& motion) {
  const auto last = terms_.begin() + count_;
  const auto term = std::find_if(terms_.begin(), last,
                                 [body](const RigidTerm& other) { return other.body == body; });
  if (term == last) terms_[count_++] = {body, 0, Vector3d::Zero()};
  term->weight += weight;
  term->arm += weight * (start - motion.rigid()[body].centre());
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
