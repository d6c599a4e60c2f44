#include "contact/contact_cache.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// How far vertices may move along each axis and count as in place, as a part of the distance within
// which pairs are found. After their contacts were found, each of two bodies may move by twice
// that. So they come nearer by at most 4 sqrt(3) times this, 9 % of the distance. That is less than
// what is beyond the thickness.
constexpr double max_move = 0.013;
// Of that distance: what is nearer may change its side while it stays in place.
constexpr double close_fraction = 0.1;
// Covers rounding in sums of displacements.
constexpr double slack = 0.999;

bool are_near(const btScalar* a, const btScalar* b, std::size_t count, btScalar tolerance) {
  constexpr std::size_t block = 64;
  for (std::size_t first = 0; first < count; first += block) {
    const std::size_t last = std::min(first + block, count);
    bool near = true;
    for (std::size_t i = first; i < last; ++i) near &= std::abs(a[i] - b[i]) <= tolerance;
    if (!near) return false;
  }
  return true;
}

// Upper bound of the difference of the displacements of two vertices, metres.
double relative_displacement(const std::vector<btScalar>& from, const std::vector<btScalar>& to) {
  constexpr btScalar infinity = std::numeric_limits<btScalar>::infinity();
  btScalar lower[3] = {infinity, infinity, infinity}, upper[3] = {-infinity, -infinity, -infinity};
  for (std::size_t i = 0; i < from.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const btScalar moved = to[i + k] - from[i + k];
      lower[k] = std::min(lower[k], moved);
      upper[k] = std::max(upper[k], moved);
    }
  }
  // Comparisons pass over what is not a number.
  if (std::any_of(to.begin(), to.end(), [](btScalar x) { return !std::isfinite(x); }))
    return infinity;
  double squared = 0;
  for (int k = 0; k < 3; ++k) squared += std::pow(static_cast<double>(upper[k] - lower[k]), 2);
  return std::sqrt(squared);
}

}  // namespace

bool ContactCache::begin(const Motion& motion, Span<const double> found_distances) {
  const std::size_t bodies = found_distances.size();
  const bool is_new = start_.size() != motion.start.size() || stays_.size() != bodies;
  distances_.assign(found_distances.begin(), found_distances.end());
  if (is_new) {
    contacts_.clear();
    start_ = motion.start;
    end_ = motion.end;
    stays_.assign(bodies, 0);
    is_close_.assign(bodies, 0);
    return false;
  }
  bool all_stay = true;
  for (std::size_t body = 0; body < bodies; ++body) {
    const auto first = 3 * static_cast<std::size_t>(motion.first_vertex[body]),
               count = 3 * static_cast<std::size_t>(motion.first_vertex[body + 1]) - first;
    const auto tolerance = static_cast<btScalar>(max_move * found_distances[body]);
    stays_[body] = !is_close_[body] &&
                   are_near(&motion.start[first], &start_[first], count, tolerance) &&
                   are_near(&motion.end[first], &end_[first], count, tolerance);
    if (stays_[body]) continue;
    all_stay = false;
    std::copy_n(&motion.start[first], count, &start_[first]);
    std::copy_n(&motion.end[first], count, &end_[first]);
  }
  // Where something is known to be close, keeps_apart() would fail: it is quicker to search.
  const double least = *std::min_element(distances_.begin(), distances_.end());
  return all_stay && !(near_distance_ >= 0 && near_distance_ < close_fraction * least);
}

bool ContactCache::is_close(const Contact& contact, const Motion& motion) const {
  const std::array<double, 4> weights = contact.weights();
  Eigen::Vector3d gap = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 4; ++i) gap += weights[i] * motion.start_of(contact.vertices[i]);
  return gap.norm() <
         close_fraction * std::min(distances_[contact.body_a], distances_[contact.body_b]);
}

void ContactCache::take(const std::vector<Contact>& found, double near_distance,
                        const Motion& motion) {
  const auto both_stay = [this](const Contact& contact) {
    return stays_[contact.body_a] && stays_[contact.body_b];
  };
  contacts_.erase(std::remove_if(contacts_.begin(), contacts_.end(),
                                 [&](const Contact& contact) { return !both_stay(contact); }),
                  contacts_.end());
  merged_.clear();
  std::fill(is_close_.begin(), is_close_.end(), 0);  // bodies that stay were close to nothing
  auto kept = contacts_.begin();
  for (const Contact& contact : found) {
    if (both_stay(contact)) continue;
    if (is_close(contact, motion)) is_close_[contact.body_a] = is_close_[contact.body_b] = 1;
    while (kept != contacts_.end() && *kept < contact) merged_.push_back(*kept++);
    merged_.push_back(contact);
  }
  merged_.insert(merged_.end(), kept, contacts_.end());
  contacts_.swap(merged_);
  near_distance_ = near_distance;
  detected_ = motion.start;
}

bool ContactCache::keeps_apart(const Motion& motion, bool at_start) const {
  const auto moved_less = [this](const std::vector<btScalar>& positions) {
    return relative_displacement(detected_, positions) < slack * near_distance_;
  };
  return moved_less(motion.start) && (at_start || moved_less(motion.end));
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
