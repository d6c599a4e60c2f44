// A contact as an inequality on the end of the step.
#pragma once

#include <Eigen/Core>
#include <array>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct ContactRow {
  Contact contact;
  Eigen::Vector3d normal;
  std::array<double, 4> weights;
  // Gaps in metres: at the start of the step; the one that impulses keep, which is never wider; and
  // the one that is opened without velocity.
  double start_gap, kept_gap, opened_gap;
  double impulse;              // kg m: the sum of what changed the solved motion, along the normal
  double opening;              // the same of the opening
  bool gives_way;              // false: what is driven meets what is driven, and no impulse acts
  bool touched = false;        // not only near
  Eigen::Vector3d tangential;  // as `impulse`, across the normal
  // 1 / sum_i w_i^2 / mass_i, kg, rigid bodies' shares included: along the normal, and at most
  // across it.
  double response, sliding_response;
  double friction;

  bool acted() const { return impulse != 0 || opening != 0 || touched; }
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
