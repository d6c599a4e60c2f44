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
      const double part = std::abs(weights[i]) * motion.shortest_edge[contact.vertices[i]];
      sum += weights[i] != 0 ? part : 0;
    }
    return sum;
  };
  const double reach = std::min(reach_at(0, first_of_b), reach_at(first_of_b, 4));
  return std::min(of_surfaces, 0.5 * reach);
}

void make_row(const Contact& contact, double thickness, double friction, double position_correction,
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
  for (const RigidTerm& part : RigidTerms(contact, row.weights, motion)) {
    const Matrix3d mobility = part.mobility(motion.rigid[part.body]);
    const double along = row.normal.dot(mobility * row.normal);
    sliding_compliance += std::max(0.0, mobility.trace() - along);
    compliance += along;
  }
  row.friction = friction;
  row.target_gap = std::min(thickness, std::max(0.0, row.start_gap));
  row.corrected_gap =
      std::max(row.target_gap, std::min(0.5 * thickness, row.target_gap + position_correction * thickness));
  // A row that only a node of small weight can serve would throw that node far away: at most 16
  // times the gap, and the next detection asks again.
  const double least = most_mobile / 256;
  // A body on rails gives way along them alone: what is left of its mobility in other directions is
  // rounding, and no stiffness is to be made of it.
  const double rounding = 1e-6 * (compliance + sliding_compliance);
  row.is_movable = compliance > rounding;
  row.normal_mass = row.is_movable ? 1 / std::max(compliance, least) : 0;
  row.tangent_mass = row.is_movable ? 1 / std::max({sliding_compliance, least, rounding}) : 0;
  row.normal_impulse = row.split_impulse = 0;
  row.tangent_impulse = Vector3d::Zero();
  row.touched = false;
}

void RowFactory::make(const Contact& contact, ContactRow& row) const {
  const PairSurface surface = surfaces_->of(contact.body_a, contact.body_b);
  const double thickness = thickness_of(contact, *motion_, surface.thickness);
  make_row(contact, thickness, surface.friction, position_correction_, *motion_, row);
}

SpeculativeContact speculative_contact_of(const ContactRow& row, const Vector3d& move) {
  SpeculativeContact speculative;
  speculative.move_squared = move.squaredNorm();
  speculative.need = row.target_gap - row.start_gap - row.normal.dot(move);
  speculative.normal_mass = row.normal_mass;
  speculative.is_movable = row.is_movable;
  speculative.may_open = row.corrected_gap > row.target_gap;
  return speculative;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
