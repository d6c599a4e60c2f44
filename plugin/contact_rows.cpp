#include "contact_rows.h"

#include <algorithm>
#include <cmath>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

double gap(const ContactRow& row, const std::vector<Eigen::Vector3d>& x) {
  double sum = 0;
  for (int i = 0; i < 4; ++i) sum += row.weights[i] * row.normal.dot(x[row.contact.vertices[i]]);
  return sum;
}

// Raises `total` (never below zero) by what brings the gap to `target`; the change in metres that
// the most mobile node would feel at full weight.
double solve(const ContactRow& row, double target, double gap_now, const Motion& motion,
             std::vector<Eigen::Vector3d>& x, double& total) {
  const double wanted = std::max(0.0, total + (target - gap_now) * row.response);
  const double change = wanted - total;
  if (change == 0) return 0;
  total = wanted;
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = row.contact.vertices[i];
    x[v] += row.weights[i] * motion.inverse_mass[v] * change * row.normal;
  }
  return std::abs(change) / row.response;
}

}  // namespace

ContactRow ContactRows::make_row(const Contact& contact, const Motion& motion) const {
  ContactRow row;
  row.contact = contact;
  row.weights = contact.weights();
  row.normal = Eigen::Vector3d(contact.normal[0], contact.normal[1], contact.normal[2]);
  double start_gap = 0, compliance = 0, most_mobile = 0;
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    start_gap += row.weights[i] * row.normal.dot(motion.start_of(v));
    compliance += row.weights[i] * row.weights[i] * motion.inverse_mass[v];
    most_mobile = std::max(most_mobile, motion.inverse_mass[v]);
  }
  const double thickness = thickness_(contact.body_a, contact.body_b);
  row.kept_gap = std::min(thickness, std::max(0.0, start_gap));
  row.opened_gap = std::max(row.kept_gap, recovery_ * thickness);
  // A row that only a node of small weight can serve would throw that node far away: at most 16
  // times the gap, and the next detection asks again.
  row.response = 1 / std::max(compliance, most_mobile / 256);
  row.impulse = row.opening = 0;
  return row;
}

void ContactRows::merge(const std::vector<Contact>& contacts, const Motion& motion) {
  std::vector<ContactRow> merged;
  merged.reserve(rows_.size() + contacts.size());
  auto old = rows_.begin();
  for (const Contact& contact : contacts) {
    while (old != rows_.end() && old->contact < contact) merged.push_back(*old++);
    merged.push_back(make_row(contact, motion));
    if (old != rows_.end() && !(contact < old->contact)) ++old;
  }
  merged.insert(merged.end(), old, rows_.end());
  rows_.swap(merged);
}

void ContactRows::relax(Motion& motion, int sweeps) {
  // A hundredth of the opened gap is well inside what keeps surfaces apart.
  double tolerance = 0;
  for (const ContactRow& row : rows_) tolerance = std::max(tolerance, 0.01 * row.opened_gap);
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    double change = 0;
    for (ContactRow& row : rows_) {
      const double now = gap(row, motion.solved);
      change = std::max(change, solve(row, row.kept_gap, now, motion, motion.solved, row.impulse));
    }
    if (change < tolerance) break;
  }
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    double change = 0;
    for (ContactRow& row : rows_) {
      const double now = gap(row, motion.solved) + gap(row, motion.opening);
      change =
          std::max(change, solve(row, row.opened_gap, now, motion, motion.opening, row.opening));
    }
    if (change < tolerance) break;
  }
  for (const ContactRow& row : rows_) {
    for (const std::int32_t v : row.contact.vertices) {
      if (motion.inverse_mass[v] > 0) motion.round_end(v);
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
