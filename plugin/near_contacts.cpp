#include "near_contacts.h"

#include <algorithm>
#include <array>

#include "lazyccd/query.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Of pairs that bind the same points, another is nearer where its gap is less than this part.
constexpr double as_near = 0.999;

// Metres, between the points of a contact, from b to a.
Eigen::Vector3d gap(const Contact& contact, const std::vector<btScalar>& positions) {
  const std::array<double, 4> weights = contact.weights();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < 4; ++i) sum += weights[i] * Motion::read(positions, contact.vertices[i]);
  return sum;
}

bool comes_within(double distance, const Contact& contact, const Motion& motion) {
  QueryPoints points;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto at = 3 * static_cast<std::size_t>(contact.vertices[i]);
    std::copy_n(&motion.start[at], 3, points[i].begin());
    std::copy_n(&motion.end[at], 3, points[4 + i].begin());
  }
  return decide_within(contact.kind, points, distance).hit;
}

// Pairs that touch, which have no normal yet; and those that stay further apart than their own
// thickness. Of one body, neighbours lie so, and what presses them together is their own matter.
bool says_nothing(const Contact& contact, double thickness, double start_gap,
                  const Motion& motion) {
  if (contact.toi > 0) return false;
  const double far = NearContacts::reach * thickness;
  if (start_gap <= far) return start_gap < 1e-6 * thickness;
  if (contact.body_a == contact.body_b) return true;
  const Eigen::Vector3d start = gap(contact, motion.start), end = gap(contact, motion.end);
  return start.dot(end) > far * start_gap || !comes_within(far, contact, motion);
}

}  // namespace

void NearContacts::look_at(Span<const Contact> found, std::size_t first, std::size_t last,
                           const IsAnswered& is_answered, const Motion& motion) {
  std::int32_t body_a = -1, body_b = -1;
  double of_surfaces = 0;
  auto before = std::lower_bound(last_.begin(), last_.end(), found[first]);
  for (std::size_t i = first; i < last; ++i) {
    const Contact& contact = found[i];
    Bond& bond = bonds_[i];
    bond.binding.kind = Binding::none;
    if (!is_answered(contact)) continue;
    if (contact.body_a != body_a || contact.body_b != body_b) {
      body_a = contact.body_a;
      body_b = contact.body_b;
      of_surfaces = surface_(body_a, body_b).thickness;
    }
    const double thickness = ContactRows::thickness(contact, motion, of_surfaces);
    bond.gap = gap(contact, motion.start).norm();
    if (says_nothing(contact, thickness, bond.gap, motion)) continue;
    bind(contact, bond.binding);
    // What was chosen in the last step goes on to be, where no other is nearer.
    while (before != last_.end() && *before < contact) ++before;
    if (before != last_.end() && !(contact < *before)) bond.gap *= as_near;
  }
}

const std::vector<Contact>& NearContacts::choose(Span<const Contact> found,
                                                 const IsAnswered& is_answered,
                                                 const Motion& motion,
                                                 const ParallelFor& parallel_for) {
  last_.swap(chosen_);
  bonds_.resize(found.size());
  parallel_for(found.size(), contacts_grain, [&](std::size_t first, std::size_t last) {
    look_at(found, first, last, is_answered, motion);
  });
  distinct_.keep(found, bonds_, chosen_);
  return chosen_;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
