#include "contact/contact_row.h"

#include <algorithm>
#include <cmath>

#include "contact/contact_checks.h"
#include "contact/rigid_terms.h"
#include "lazyccd/debug/assert.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

double thickness_of(const Contact& contact, const Motion& motion, double surface_thickness) {
  if (contact.body_a != contact.body_b) return surface_thickness;
  const std::array<double, 4> weights = contact.weights();
  const int first_of_b = first_vertex_of_b(contact.kind);
  const auto edge_length_at = [&](int first, int last) {
    double sum = 0;
    for (int i = first; i < last; ++i) {
      // A vertex of weight zero may have no edge and hence an infinite length: 0 * infinity is NaN.
      const double length = std::abs(weights[i]) * motion.shortest_edge()[contact.vertices[i]];
      sum += weights[i] != 0 ? length : 0;
    }
    return sum;
  };
  const double edge_length = std::min(edge_length_at(0, first_of_b), edge_length_at(first_of_b, 4));
  return std::min(surface_thickness, settings::row::max_thickness_of_edge * edge_length);
}

namespace {

// As SlidingFriction::per_step(), at the points of the contact.
double sliding_fraction(const SlidingFriction& sliding, const ContactRow& row,
                        const Motion& motion) {
  if (sliding.iterations == 0) return 0;
  const int first_of_b = first_vertex_of_b(row.contact.kind);
  std::array<double, 2> inverse_mass = {0, 0}, squares = {0, 0};
  for (int i = 0; i < 4; ++i) {
    const int side = i < first_of_b ? 0 : 1;
    inverse_mass[side] +=
        std::abs(row.weights[i]) * motion.inverse_mass_of(row.contact.vertices[i]);
    squares[side] += row.weights[i] * row.weights[i];
  }
  const double sum = inverse_mass[0] + inverse_mass[1];
  if (!(sum > 0)) return sliding.per_step({1, 0}, {1, 0});
  return sliding.per_step({inverse_mass[0] / sum, inverse_mass[1] / sum}, squares);
}

}  // namespace

void make_row(const Contact& contact, double thickness, double position_correction,
              const Motion& motion, ContactRow& row) {
  row.contact = contact;
  row.weights = contact.weights();
  row.normal = Vector3d(contact.normal[0], contact.normal[1], contact.normal[2]);
  row.start_gap = 0;
  double compliance = 0, tangent_compliance = 0, max_inverse_mass = 0;
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    row.start_gap += row.weights[i] * row.normal.dot(motion.start_of(v));
    if (!motion.is_free(v)) continue;
    const double share = row.weights[i] * row.weights[i] * motion.inverse_mass()[v];
    compliance += share;
    tangent_compliance += share;
    max_inverse_mass = std::max(max_inverse_mass, motion.inverse_mass()[v]);
  }
  const bool has_free_nodes = compliance > 0;
  double held_compliance = 0;  // along the normal, while bodies are held at their supports
  for (const RigidTerm& term : RigidTerms(contact, row.weights, motion)) {
    const Matrix3d mobility = term.mobility(motion);
    if (!has_free_nodes) held_compliance += row.normal.dot(term.held_mobility(motion) * row.normal);
    const double normal_part = row.normal.dot(mobility * row.normal);
    tangent_compliance += std::max(0.0, mobility.trace() - normal_part);
    compliance += normal_part;
  }
  row.friction = row.sliding_fraction = 0;
  row.target_gap = std::min(thickness, std::max(0.0, row.start_gap));
  row.corrected_gap =
      row.target_gap +
      corrected_share(position_correction, motion.dt()) *
          std::max(0.0, settings::row::corrected_thickness * thickness - row.target_gap);
  row.loaded_gap = row.target_gap;
  // Lower bound of the compliance.
  const double min_compliance = max_inverse_mass / settings::row::max_mass_ratio;
  // A body with locked axes moves along its free axes alone. Its mobility in the other directions
  // is rounding error, which must not be inverted to a huge mass.
  const double rounding = 1e-6 * (compliance + tangent_compliance);
  row.can_act = (has_free_nodes ? compliance : held_compliance) > rounding;
  row.normal_mass = row.can_act ? 1 / std::max(compliance, min_compliance) : 0;
  row.tangent_mass = row.can_act ? 1 / std::max({tangent_compliance, min_compliance, rounding}) : 0;
  row.normal_impulse = row.split_impulse = 0;
  row.tangent_impulse = Vector3d::Zero();
  row.touched = false;
}

void RowFactory::make(const Contact& contact, ContactRow& row) const {
  const PairSurface surface = surfaces_->of(contact.body_a, contact.body_b);
  const double thickness = thickness_of(contact, *motion_, surface.thickness);
  make_row(contact, thickness, position_correction_, *motion_, row);
  row.loaded_gap = std::max(row.loaded_gap, surface.resolution);
  if (surface.parting_speed > 0) {
    const double parted = row.target_gap + surface.parting_speed * motion_->dt();
    row.corrected_gap = row.loaded_gap = std::max(
        row.corrected_gap, std::min(settings::row::corrected_thickness * thickness, parted));
  }
  row.friction = surface.friction;
  row.sliding_fraction = sliding_fraction(surface.sliding, row, *motion_);
  LAZYCCD_ASSERT(sum_to_zero(row.weights), "the weights of a row sum to zero");
  LAZYCCD_ASSERT(is_unit(row.normal), "the normal of a row has length 1");
  LAZYCCD_ASSERT(std::isfinite(row.start_gap), "a row begins with a finite gap");
  LAZYCCD_ASSERT(row.normal_mass >= 0 && std::isfinite(row.normal_mass),
                 "the effective mass of a row is finite and not negative");
  LAZYCCD_ASSERT(row.friction >= 0 && row.sliding_fraction >= 0 && row.sliding_fraction <= 1,
                 "friction opposes the sliding");
}

void RowFactory::make_penetration(const Contact& contact, double distance, ContactRow& row) const {
  make(contact, row);
  row.friction = row.sliding_fraction = 0;
  row.target_gap = std::min(0.0, row.start_gap);
  row.corrected_gap = row.loaded_gap = row.target_gap + distance;
}

void RowFactory::make_link(const LinkLimit& limit, ContactRow& row) const {
  make_row(contact_of(limit), 0, 0, *motion_, row);
  row.target_gap = row.corrected_gap = row.loaded_gap = -limit.longest;
  row.normal_impulse = row.can_act ? limit.impulse : 0;
}

Contact contact_of(const LinkLimit& limit) {
  const auto [a, b] = limit.vertices;
  Contact contact;
  contact.kind = ContactKind::edge_edge;
  contact.body_a = contact.body_b = limit.body;
  contact.primitive_a = contact.primitive_b = std::numeric_limits<std::int32_t>::min() + limit.link;
  contact.vertices = {a, a, b, b};
  contact.u = contact.v = 0;
  for (int k = 0; k < 3; ++k)
    contact.normal[static_cast<std::size_t>(k)] = static_cast<float>(-limit.direction[k]);
  contact.toi = 1;
  return contact;
}

RowEstimate estimate_row(const ContactRow& row, const Vector3d& move) {
  RowEstimate estimate;
  estimate.move_squared = move.squaredNorm();
  estimate.need = row.target_gap - row.start_gap - row.normal.dot(move);
  estimate.normal_mass = row.normal_mass;
  estimate.can_act = row.can_act;
  estimate.may_need_split = row.corrected_gap > row.target_gap;
  return estimate;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
