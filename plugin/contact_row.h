// A contact as an inequality on the end of the step.
#pragma once

#include <Eigen/Core>
#include <array>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"
#include "motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// What of a contact moves with a dynamic rigid body: its own vertices, and those that it carries.
struct RigidPart {
  int body = -1;                                  // index in Motion::rigid; -1: none
  double weight = 0;                              // the sum of the vertices' weights
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();  // sum_i w_i (x_i - centre), metres

  // Of the vertices' weighted sum, where the body shifts and turns.
  Eigen::Vector3d moved(const Eigen::Vector3d& shift, const Eigen::Vector3d& turn) const {
    return weight * shift + turn.cross(arm);
  }
  // Adds what an impulse on that sum does to the body.
  void push(const RigidMotion& rigid, const Eigen::Vector3d& impulse, Eigen::Vector3d& shift,
            Eigen::Vector3d& turn) const {
    shift += weight * rigid.inverse_mass.cwiseProduct(impulse);
    turn += rigid.inverse_inertia * arm.cross(impulse);
  }
};

struct ContactRow {
  Contact contact;
  std::array<double, 4> weights;
  Eigen::Vector3d normal;
  // Gaps in metres: at the start of the step; the one that impulses keep, which is never wider; and
  // the one that is opened without velocity.
  double start_gap, kept_gap, opened_gap;
  // Metres by which the predicted motion narrows the gap, and by which it may.
  double approach, remaining;
  double friction;
  // 1 / sum_i w_i^2 / mass_i, kg, rigid bodies' shares included: along the normal, and at most
  // across it.
  double response, sliding_response;
  double impulse;              // kg m: the sum of what changed the solved motion, along the normal
  Eigen::Vector3d tangential;  // the same across it
  double opening;              // the same of the opening
  bool touched = false;        // not only near
  bool gives_way;              // false: what is driven meets what is driven, and no impulse acts

  // The first ones; vertices of a third body count as fixed.
  std::array<RigidPart, 2> rigid;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
