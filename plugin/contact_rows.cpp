#include "contact_rows.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "rigid_parts.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Of infinite mass.
bool has_fixed_side(const Contact& contact, const Motion& motion) {
  const int first_of_b = contact.kind == ContactKind::vertex_face ? 1 : 2;
  const auto is_fixed = [&](std::int32_t body, int first, int last) {
    const int rigid = motion.rigid_of_body[body];
    if (rigid >= 0) return !motion.rigid[rigid].is_dynamic();
    return std::none_of(&contact.vertices[first], contact.vertices.data() + last,
                        [&](std::int32_t v) { return motion.gives_way(v); });
  };
  return is_fixed(contact.body_a, 0, first_of_b) || is_fixed(contact.body_b, first_of_b, 4);
}

}  // namespace

Vector3d separation(const ContactRow& row, const Motion& motion) {
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = row.contact.vertices[i];
    sum += row.weights[i] * (motion.is_free(v) ? motion.solved : motion.predicted)[v];
  }
  for (const RigidPart& part : RigidParts(row.contact, row.weights, motion)) {
    const RigidMotion& body = motion.rigid[part.body];
    sum += part.moved(body.shift, body.turn);
  }
  return sum;
}

double ContactRows::thickness(const Contact& contact, const Motion& motion, double of_surfaces) {
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

void ContactRows::make_row(const Contact& contact, const PairSurface& surface, const Motion& motion,
                           ContactRow& row) const {
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
  const double thickness = ContactRows::thickness(contact, motion, surface.thickness);
  row.friction = surface.friction;
  row.kept_gap = std::min(thickness, std::max(0.0, row.start_gap));
  row.opened_gap =
      std::max(row.kept_gap, std::min(0.5 * thickness, row.kept_gap + recovery_ * thickness));
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
}

void ContactRows::make_rows(const std::vector<Contact>& contacts, bool touching,
                            const Motion& motion, std::vector<ContactRow>& rows) const {
  rows.resize(contacts.size());
  PairSurface surface = {};
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& contact = contacts[i];
    if (i == 0 || contact.body_a != contacts[i - 1].body_a ||
        contact.body_b != contacts[i - 1].body_b)
      surface = surface_(contact.body_a, contact.body_b);
    make_row(contact, surface, motion, rows[i]);
    rows[i].touched = touching;
  }
}

void ContactRows::begin_step() {
  remembered_.clear();
  for (const ContactRow* const row : acted()) {
    if (row->impulse == 0) continue;
    if (remembered_.empty() || remembered_.back().contact < row->contact)
      remembered_.push_back({row->contact, Eigen::Vector3d::Zero()});
    remembered_.back().impulse += row->impulse * row->normal + row->tangential;
  }
  rows_.clear();
  acted_.clear();
}

const std::vector<const ContactRow*>& ContactRows::acted() {
  if (!acted_.empty()) return acted_;
  std::size_t next = 0;  // row that is not looked at yet
  const auto are_of_a_pair = [this](std::size_t i, std::size_t j) {
    return !(rows_[i].contact < rows_[j].contact);
  };
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!rows_[i].acted()) continue;
    std::size_t first = i;
    while (first > next && are_of_a_pair(first - 1, i)) --first;
    for (next = first; next <= i || (next < rows_.size() && are_of_a_pair(i, next)); ++next)
      acted_.push_back(&rows_[next]);
    i = next - 1;
  }
  return acted_;
}

void ContactRows::forget() {
  rows_.clear();
  acted_.clear();
  remembered_.clear();
}

void ContactRows::start_warm() {
  acted_.clear();
  auto last = remembered_.begin();
  for (ContactRow& row : rows_) {
    while (last != remembered_.end() && last->contact < row.contact) ++last;
    if (last == remembered_.end()) break;
    if (row.contact < last->contact || !row.gives_way) continue;
    row.impulse = std::max(0.0, row.normal.dot(last->impulse));
    row.tangential = last->impulse - row.normal.dot(last->impulse) * row.normal;
    const double most = row.friction * row.impulse, size = row.tangential.norm();
    if (size > most) row.tangential *= most / size;
  }
}

void ContactRows::start_cold(Motion& motion) {
  acted_.clear();
  motion.restart_response();
  for (ContactRow& row : rows_) {
    row.impulse = row.opening = 0;
    row.tangential.setZero();
  }
}

bool ContactRows::add(const std::vector<Contact>& contacts, bool touching, const Motion& motion) {
  acted_.clear();
  make_rows(contacts, touching, motion, added_);
  const bool gives_way = std::any_of(added_.begin(), added_.end(),
                                     [](const ContactRow& row) { return row.gives_way; });
  if (rows_.empty()) {
    rows_.swap(added_);
    return gives_way;
  }
  merged_.clear();
  merged_.reserve(rows_.size() + added_.size());
  auto old = rows_.begin();
  for (const ContactRow& row : added_) {
    while (old != rows_.end() && old->contact < row.contact) merged_.push_back(*old++);
    while (old != rows_.end() && !(row.contact < old->contact)) {
      if (old->impulse > 0 || old->opening > 0) merged_.push_back(*old);
      ++old;
    }
    merged_.push_back(row);
  }
  merged_.insert(merged_.end(), old, rows_.end());
  rows_.swap(merged_);
  return gives_way;
}

void ContactRows::narrow(double part, const Motion& motion) {
  constexpr double fulfilled = 0.9;
  for (ContactRow& row : rows_) {
    if (!has_fixed_side(row.contact, motion) ||
        row.normal.dot(separation(row, motion)) >= fulfilled * row.kept_gap)
      continue;
    const double of_surfaces = surface_(row.contact.body_a, row.contact.body_b).thickness;
    const double whole = thickness(row.contact, motion, of_surfaces);
    row.kept_gap = row.opened_gap = std::min(row.kept_gap, part * whole);
  }
}

void ContactRows::relax(Motion& motion, int sweeps) {
  acted_.clear();
  for (const auto of : {ContactProblem::Of::motion, ContactProblem::Of::opening}) {
    problem_.set_up(of, rows_, motion);
    problem_.solve(sweeps);
    problem_.write(rows_, motion);
  }
  for (RigidMotion& body : motion.rigid) {
    if (body.is_dynamic()) motion.place(body);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
