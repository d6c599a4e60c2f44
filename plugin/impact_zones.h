// What is left where impulses do not end: nodes that move as one rigid body, and nodes that stay.
//
// Rigid impact zones: Provot 1997, "Collision and self-collision handling in cloth model dedicated
// to design garments"; Harmon et al. 2008, "Robust Treatment of Simultaneous Collisions". A zone
// keeps the linear and angular momentum of its nodes. Inside one, the motion from start to end is
// affine and invertible at all times, so nothing inside it can touch.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/contact.h"
#include "motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ImpactZones {
 public:
  explicit ImpactZones(const Motion& motion);

  // Joins the zones of each contact's four nodes, then moves every zone rigidly from the start of
  // the step with the momenta that its nodes had when this object was made. A zone with nodes of
  // infinite mass follows them where they all move alike, and stays where they do not.
  void absorb(const std::vector<Contact>& contacts, Motion& motion);

  std::int64_t node_count() const;  // in zones of more than one node

 private:
  std::int32_t find(std::int32_t i);
  void move(const std::vector<std::int32_t>& zone, Motion& motion) const;

  std::vector<std::int32_t> parent_;
  std::vector<Eigen::Vector3d> solved_;  // before any zone
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
