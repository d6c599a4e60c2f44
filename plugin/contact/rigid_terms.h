// What of a contact moves with dynamic rigid bodies: their own vertices, and those that they carry.
#pragma once

#include <Eigen/Core>
#include <array>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// With one body.
struct RigidTerm {
  int body;             // index in Motion::rigid
  double weight;        // the sum of the vertices' weights
  Eigen::Vector3d arm;  // sum_i w_i (x_i - centre), metres

  // Of the vertices' weighted sum, where the body shifts and turns.
  Eigen::Vector3d moved(const Eigen::Vector3d& translation, const Eigen::Vector3d& rotation) const {
    return weight * translation + rotation.cross(arm);
  }
  // Adds what an impulse on that sum does to the body.
  void push(const RigidMotion& rigid, const Eigen::Vector3d& impulse, Eigen::Vector3d& translation,
            Eigen::Vector3d& rotation) const {
    translation += weight * rigid.inverse_mass.cwiseProduct(impulse);
    rotation += rigid.inverse_inertia * arm.cross(impulse);
  }
  // Displacement of the sum per impulse on it.
  Eigen::Matrix3d mobility(const RigidMotion& rigid) const;
};

// Of the four vertices of a contact, in their order. Nothing of it is kept with the contacts: most
// have none.
class RigidTerms {
 public:
  RigidTerms(const Contact& contact, const std::array<double, 4>& weights, const Motion& motion) {
    const int a = motion.rigid_of_body[contact.body_a];
    const int obstacle = a >= 0 ? a : motion.rigid_of_body[contact.body_b];
    if (obstacle >= 0 || !motion.anchored.empty()) find(obstacle, contact, weights, motion);
  }

  const RigidTerm* begin() const { return parts_.data(); }
  const RigidTerm* end() const { return parts_.data() + count_; }

 private:
  void find(int obstacle, const Contact& contact, const std::array<double, 4>& weights,
            const Motion& motion);
  void add(int body, double weight, const Eigen::Vector3d& start, const Motion& motion);

  int count_ = 0;
  std::array<RigidTerm, 4> parts_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
