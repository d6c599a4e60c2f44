// What assertions ask of contacts and of their rows.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "contact/contact_row.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Whether contacts are in the order of operator<, none twice.
inline bool are_sorted(Span<const Contact> contacts) {
  const auto is_not_before = [](const Contact& a, const Contact& b) { return !(a < b); };
  return std::adjacent_find(contacts.begin(), contacts.end(), is_not_before) == contacts.end();
}

/// Whether rows are in the order of their contacts. A pair may have several.
inline bool are_in_order(const std::vector<const ContactRow*>& rows) {
  return std::is_sorted(rows.begin(), rows.end(), [](const ContactRow* a, const ContactRow* b) {
    return a->contact < b->contact;
  });
}
inline bool are_in_order(const std::vector<ContactRow>& rows) {
  return std::is_sorted(rows.begin(), rows.end(), [](const ContactRow& a, const ContactRow& b) {
    return a.contact < b.contact;
  });
}

/// Whether each contact names two bodies of the motion, and vertices of these bodies.
inline bool are_of(Span<const Contact> contacts, const Motion& motion) {
  const auto bodies = static_cast<std::int32_t>(motion.rigid_of_body().size());
  return std::all_of(contacts.begin(), contacts.end(), [&](const Contact& contact) {
    const auto is_of = [&](std::int32_t body, int first, int last) {
      return body >= 0 && body < bodies &&
             std::all_of(
                 &contact.vertices[first], contact.vertices.data() + last, [&](std::int32_t v) {
                   return v >= motion.first_vertex()[body] && v < motion.first_vertex()[body + 1];
                 });
    };
    const int first_of_b = first_vertex_of_b(contact.kind);
    return is_of(contact.body_a, 0, first_of_b) && is_of(contact.body_b, first_of_b, 4);
  });
}

/// Bound of `count` roundings to Scalar of numbers of at most 1.
template <class Scalar>
constexpr double roundings(int count) {
  return count * static_cast<double>(std::numeric_limits<Scalar>::epsilon());
}

/// Whether the weights of a row sum to zero, so that its impulses add no momentum.
inline bool sum_to_zero(const std::array<double, 4>& weights) {
  return std::abs(weights[0] + weights[1] + weights[2] + weights[3]) <= roundings<double>(16);
}

/// Whether a normal has length 1, but for the rounding of float.
inline bool is_unit(const Vector3d& normal) {
  return std::abs(normal.squaredNorm() - 1) <= roundings<float>(64);
}

/// Bound of the rounding of a gap at the start of the step, metres: u, v and the normal are float.
inline double rounding_of_gap(const ContactRow& row, const Motion& motion) {
  double largest = 0;
  for (const std::int32_t v : row.contact.vertices)
    largest = std::max(largest, motion.start_of(v).cwiseAbs().maxCoeff());
  return roundings<float>(8) * largest;
}

/// Whether the start of the step satisfies a row, but for rounding.
inline bool start_satisfies(const ContactRow& row, const Motion& motion) {
  return row.target_gap <= row.start_gap + rounding_of_gap(row, motion);
}

/// Whether the normals of two rows of a pair point to one side. This is asked of contacts at the
/// start of the step alone: a pair that meets later, and turns, may meet again from the other side.
inline bool have_one_sign(const ContactRow& a, const ContactRow& b) {
  return a.contact.toi > 0 || b.contact.toi > 0 || a.normal.dot(b.normal) >= 0;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
