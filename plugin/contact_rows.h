// Contacts of a step as inequalities on the end positions, solved together.
//
// Each contact is one row: with its normal n and weights w (sum zero), the gap at the end of the
// step, sum_i w_i n.x_i, is to stay at a target or wider. Impulses act on all four nodes in the
// ratio w_i / mass_i, so they add no linear momentum whatever the masses. Normals only: friction
// and restitution would be further unknowns of a row.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct ContactRow {
  Contact contact;
  std::array<double, 4> weights;
  Eigen::Vector3d normal;
  // Gaps in metres: the one that impulses keep, which is never wider than at the start of the step,
  // and the one that is opened without velocity.
  double kept_gap, opened_gap;
  double response;  // 1 / sum_i w_i^2 / mass_i, kg
  double impulse;   // kg m: the sum of what changed `solved`
  double opening;   // the same of `opening`
};

class ContactRows {
 public:
  // Thickness in metres between two bodies.
  using Thickness = std::function<double(std::int32_t body_a, std::int32_t body_b)>;

  ContactRows(Thickness thickness, double recovery)
      : thickness_(std::move(thickness)), recovery_(recovery) {}

  void clear() { rows_.clear(); }
  // Adds contacts, which come sorted. A pair that is in contact again gets its new normal and
  // weights; what it moved already stays.
  void merge(const std::vector<Contact>& contacts, const Motion& motion);
  // Projected Gauss-Seidel over the rows in their order. Rounds the ends of the vertices in
  // contact.
  void relax(Motion& motion, int sweeps);

  const std::vector<ContactRow>& rows() const { return rows_; }

 private:
  ContactRow make_row(const Contact& contact, const Motion& motion) const;

  Thickness thickness_;
  double recovery_;
  std::vector<ContactRow> rows_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
