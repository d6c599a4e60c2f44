#include "response/contact_constraints.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "contact/rigid_terms.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Eigen::Vector3d;

// Of infinite mass.
bool has_fixed_side(const Contact& contact, const Motion& motion) {
  const int first_of_b = contact.kind == ContactKind::vertex_face ? 1 : 2;
  const auto is_fixed = [&](std::int32_t body, int first, int last) {
    const int rigid = motion.rigid_of_body[body];
    if (rigid >= 0) return !motion.rigid[rigid].is_dynamic();
    return std::none_of(&contact.vertices[first], contact.vertices.data() + last,
                        [&](std::int32_t v) { return motion.is_movable(v); });
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
  for (const RigidTerm& part : RigidTerms(row.contact, row.weights, motion)) {
    const RigidMotion& body = motion.rigid[part.body];
    sum += part.moved(body.translation, body.rotation);
  }
  return sum;
}

void ContactConstraints::begin_step() {
  remembered_.clear();
  for (const ContactRow* const row : is_active()) {
    if (row->normal_impulse == 0) continue;
    if (remembered_.empty() || remembered_.back().contact < row->contact)
      remembered_.push_back({row->contact, Eigen::Vector3d::Zero()});
    remembered_.back().impulse += row->normal_impulse * row->normal + row->tangent_impulse;
  }
  rows_.clear();
  acted_.clear();
}

const std::vector<const ContactRow*>& ContactConstraints::is_active() {
  if (!acted_.empty()) return acted_;
  std::size_t next = 0;  // row that is not looked at yet
  const auto are_of_a_pair = [this](std::size_t i, std::size_t j) {
    return rows_.is_made(i) && rows_.is_made(j) && !(rows_[i].contact < rows_[j].contact);
  };
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!rows_.is_made(i) || !rows_[i].is_active()) continue;
    std::size_t first = i;
    while (first > next && are_of_a_pair(first - 1, i)) --first;
    for (next = first; next <= i || (next < rows_.size() && are_of_a_pair(i, next)); ++next)
      acted_.push_back(&rows_[next]);
    i = next - 1;
  }
  return acted_;
}

void ContactConstraints::forget() {
  rows_.clear();
  acted_.clear();
  remembered_.clear();
}

void ContactConstraints::take(const SpeculativePairs& near, const Motion& motion) {
  acted_.clear();
  rows_.take(near, RowFactory(surfaces_, position_correction_, motion));
}

void ContactConstraints::start_warm() {
  acted_.clear();
  std::size_t first = 0;  // row that may be of the next pair
  for (const Remembered& last : remembered_) {
    first = rows_.find(last.contact, first);
    for (; first < rows_.size() && !(last.contact < rows_.contact(first)); ++first) {
      if (!rows_.is_movable(first)) continue;
      ContactRow& row = rows_[first];
      row.normal_impulse = std::max(0.0, row.normal.dot(last.impulse));
      row.tangent_impulse = last.impulse - row.normal.dot(last.impulse) * row.normal;
      const double most = row.friction * row.normal_impulse, size = row.tangent_impulse.norm();
      if (size > most) row.tangent_impulse *= most / size;
    }
  }
}

void ContactConstraints::start_cold(Motion& motion) {
  acted_.clear();
  motion.restart_response();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!rows_.is_made(i)) continue;
    rows_[i].normal_impulse = rows_[i].split_impulse = 0;
    rows_[i].tangent_impulse.setZero();
  }
}

bool ContactConstraints::add(const std::vector<Contact>& contacts, const Motion& motion) {
  acted_.clear();
  merged_.clear();
  merged_.reserve(rows_.size() + contacts.size());
  std::size_t old = 0;
  // Of what was only near, most may say nothing.
  const auto keep = [&] {
    if (rows_.is_movable(old) || rows_.is_made(old)) rows_.copy(old, merged_);
    ++old;
  };
  const RowFactory factory(surfaces_, position_correction_, motion);
  bool is_movable = false;
  for (const Contact& contact : contacts) {
    while (old < rows_.size() && rows_.contact(old) < contact) keep();
    for (; old < rows_.size() && !(contact < rows_.contact(old)); ++old) {
      if (!rows_.is_made(old)) continue;
      const ContactRow& row = rows_[old];
      if (row.normal_impulse > 0 || row.split_impulse > 0) merged_.push_back(row);
    }
    ContactRow& row = merged_.emplace_back();
    factory.make(contact, row);
    row.touched = true;
    is_movable = is_movable || row.is_movable;
  }
  while (old < rows_.size()) keep();
  rows_.take(merged_);
  return is_movable;
}

void ContactConstraints::narrow(double part, const Motion& motion) {
  constexpr double fulfilled = 0.9;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!rows_.is_movable(i)) continue;
    ContactRow& row = rows_[i];
    if (!has_fixed_side(row.contact, motion) ||
        row.normal.dot(separation(row, motion)) >= fulfilled * row.target_gap)
      continue;
    const double of_surfaces = surfaces_.of(row.contact.body_a, row.contact.body_b).thickness;
    const double whole = thickness_of(row.contact, motion, of_surfaces);
    row.target_gap = row.corrected_gap = std::min(row.target_gap, part * whole);
  }
}

void ContactConstraints::relax(Motion& motion, int sweeps) {
  acted_.clear();
  for (const auto of : {ContactSolver::Of::motion, ContactSolver::Of::opening}) {
    problem_.set_up(of, rows_, motion);
    problem_.solve(sweeps);
    problem_.write(motion);
  }
  for (RigidMotion& body : motion.rigid) {
    if (body.is_dynamic()) motion.place(body);
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
