#include "contact/contact_cache.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// How far vertices may move along each axis and count as in place, as a part of the distance within
// which pairs are found. Each of two bodies may move by twice that after their contacts were found,
// so they come nearer by at most 4 sqrt(3) times this: less than the 9 % of the distance that are
// beyond the thickness.
constexpr double max_move = 0.013;
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
  double squared = 0;
  for (int k = 0; k < 3; ++k) squared += std::pow(static_cast<double>(upper[k] - lower[k]), 2);
  return std::sqrt(squared);
}

}  // namespace

bool ContactCache::begin(const Motion& motion, Span<const double> found_distances) {
  const std::size_t bodies = found_distances.size();
  const bool is_new = start_.size() != motion.start.size() || stays_.size() != bodies;
  if (is_new) {
    contacts_.clear();
    start_ = motion.start;
    end_ = motion.end;
    stays_.assign(bodies, 0);
    return false;
  }
  bool all_stay = true;
  for (std::size_t body = 0; body < bodies; ++body) {
    const auto first = 3 * static_cast<std::size_t>(motion.first_vertex[body]),
               count = 3 * static_cast<std::size_t>(motion.first_vertex[body + 1]) - first;
    const auto tolerance = static_cast<btScalar>(max_move * found_distances[body]);
    stays_[body] = are_near(&motion.start[first], &start_[first], count, tolerance) &&
                   are_near(&motion.end[first], &end_[first], count, tolerance);
    if (stays_[body]) continue;
    all_stay = false;
    std::copy_n(&motion.start[first], count, &start_[first]);
    std::copy_n(&motion.end[first], count, &end_[first]);
  }
  return all_stay;
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
  auto kept = contacts_.begin();
  for (const Contact& contact : found) {
    if (both_stay(contact)) continue;
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
