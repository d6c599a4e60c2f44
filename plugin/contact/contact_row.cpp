#include "contact/contact_row.h"

#include <algorithm>
#include <cmath>

#include "contact/rigid_terms.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

using Eigen::Matrix3d;
using Eigen::Vector3d;

double thickness_of(const Contact& contact, const Motion& motion, double of_surfaces) {
  if (contact.body_a != contact.body_b) return of_surfaces;
  const std::array<double, 4> weights = contact.weights();
  const int first_of_b = contact.kind == ContactKind::vertex_face ? 1 : 2;
  const auto reach_at = [&](int first, int last) {
    double sum = 0;
    for (int i = first; i < last; ++i) {
      // What has no part in a point may have no edge either, and no end to its reach.
      const double part = std::abs(weights[i]) * motion.reach[contact.vertices[i]];
      sum += weights[i] != 0 ? part : 0;
    }
    return sum;
  };
  const double reach = std::min(reach_at(0, first_of_b), reach_at(first_of_b, 4));
  return std::min(of_surfaces, 0.5 * reach);
}

void make_row(const Contact& contact, double thickness, double friction, double recovery,
              const Motion& motion, ContactRow& row) {
  row.contact = contact;
  row.weights = contact.weights();
  row.normal = Vector3d(contact.normal[0], contact.normal[1], contact.normal[2]);
  row.start_gap = 0;
  double compliance = 0, sliding_compliance = 0, most_mobile = 0;
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    row.start_gap += row.weights[i] * row.normal.dot(motion.start_of(v));
    if (!motion.is_free(v)) continue;
    const double share = row.weights[i] * row.weights[i] * motion.inverse_mass[v];
    compliance += share;
    sliding_compliance += share;
    most_mobile = std::max(most_mobile, motion.inverse_mass[v]);
  }
  for (const RigidPart& part : RigidParts(contact, row.weights, motion)) {
    const Matrix3d mobility = part.mobility(motion.rigid[part.body]);
    const double along = row.normal.dot(mobility * row.normal);
    sliding_compliance += std::max(0.0, mobility.trace() - along);
    compliance += along;
  }
  row.friction = friction;
  row.kept_gap = std::min(thickness, std::max(0.0, row.start_gap));
  row.opened_gap =
      std::max(row.kept_gap, std::min(0.5 * thickness, row.kept_gap + recovery * thickness));
  // A row that only a node of small weight can serve would throw that node far away: at most 16
  // times the gap, and the next detection asks again.
  const double least = most_mobile / 256;
  // A body on rails gives way along them alone: what is left of its mobility in other directions is
  // rounding, and no stiffness is to be made of it.
  const double rounding = 1e-6 * (compliance + sliding_compliance);
  row.gives_way = compliance > rounding;
  row.response = row.gives_way ? 1 / std::max(compliance, least) : 0;
  row.sliding_response = row.gives_way ? 1 / std::max({sliding_compliance, least, rounding}) : 0;
  row.impulse = row.opening = 0;
  row.tangential = Vector3d::Zero();
  row.touched = false;
}

Prospect prospect_of(const ContactRow& row, const Vector3d& move) {
  Prospect prospect;
  prospect.move_squared = move.squaredNorm();
  prospect.need = row.kept_gap - row.start_gap - row.normal.dot(move);
  prospect.response = row.response;
  prospect.gives_way = row.gives_way;
  prospect.may_open = row.opened_gap > row.kept_gap;
  return prospect;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
