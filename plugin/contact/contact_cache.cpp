#include "contact/contact_cache.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/contact_checks.h"
#include "lazyccd/debug/assert.h"
#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

constexpr double slack = 0.999;  // covers rounding in sums of displacements

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

double largest_difference(const btScalar* a, const btScalar* b, std::size_t count) {
  double largest = 0;
  for (std::size_t i = 0; i < count; ++i)
    largest = std::max(largest, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
  return largest;
}

// Bounds of the displacements of vertices.
class Displacements {
 public:
  void add(const btScalar* from, const btScalar* to, std::size_t count) {
    for (std::size_t i = 0; i < count; i += 3) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double moved = static_cast<double>(to[i + k]) - static_cast<double>(from[i + k]);
        lower_[k] = std::min(lower_[k], moved);
        upper_[k] = std::max(upper_[k], moved);
        is_finite_ = is_finite_ && std::isfinite(moved);
      }
    }
  }
  // Upper bound of the difference of any two of them, metres.
  double largest_difference() const {
    if (!is_finite_) return std::numeric_limits<double>::infinity();
    double squared = 0;
    for (int k = 0; k < 3; ++k) {
      const double difference = upper_[k] - lower_[k];
      if (difference > 0) squared += difference * difference;
    }
    return std::sqrt(squared);
  }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  double lower_[3] = {infinity, infinity, infinity}, upper_[3] = {-infinity, -infinity, -infinity};
  bool is_finite_ = true;  // comparisons pass over what is not a number
};

// The coordinates of a body in arrays with three for each vertex.
struct Coordinates {
  std::size_t first, count;
};

Coordinates coordinates_of(const Motion& motion, std::size_t body) {
  const auto first = 3 * static_cast<std::size_t>(motion.first_vertex()[body]),
             last = 3 * static_cast<std::size_t>(motion.first_vertex()[body + 1]);
  return {first, last - first};
}

}  // namespace

void ContactCache::renumber(const ContactRenumbering& numbers, std::size_t coordinate_count) {
  if (start_.empty()) return;
  std::vector<btScalar> start(coordinate_count), end(coordinate_count);
  // A body whose distance is not known does not stay.
  std::vector<double> near_distances(numbers.new_count(), -1), drifts(numbers.new_count(), 0);
  std::vector<char> stays(numbers.new_count(), 0);
  for (std::size_t old = 0; old < stays_.size(); ++old) {
    const std::int32_t body = numbers[static_cast<std::int32_t>(old)];
    if (body < 0) continue;
    const IndexRange from = numbers.old_primitives(static_cast<std::int32_t>(old)).vertices;
    const std::int32_t to = numbers.new_primitives(body).vertices.first;
    const auto copy = [&](const std::vector<btScalar>& before, std::vector<btScalar>& now) {
      std::copy(before.begin() + 3 * static_cast<std::ptrdiff_t>(from.first),
                before.begin() + 3 * static_cast<std::ptrdiff_t>(from.last),
                now.begin() + 3 * static_cast<std::ptrdiff_t>(to));
    };
    copy(start_, start);
    copy(end_, end);
    near_distances[static_cast<std::size_t>(body)] = near_distances_[old];
    drifts[static_cast<std::size_t>(body)] = drifts_[old];
    stays[static_cast<std::size_t>(body)] = stays_[old];
  }
  start_.swap(start);
  end_.swap(end);
  near_distances_.swap(near_distances);
  drifts_.swap(drifts);
  stays_.swap(stays);
  contacts_.erase(
      std::remove_if(contacts_.begin(), contacts_.end(),
                     [&numbers](Contact& contact) { return !numbers.renumber(contact); }),
      contacts_.end());
  LAZYCCD_ASSERT(are_sorted(contacts_), "renumbering keeps the order of contacts");
}

bool ContactCache::begin(const Motion& motion, Span<const double> found_distances) {
  const std::size_t bodies = found_distances.size();
  LAZYCCD_ASSERT(bodies < motion.first_vertex().size(),
                 "distances within which pairs are found are of bodies of the motion");
  const bool is_new = start_.size() != motion.start().size() || stays_.size() != bodies;
  if (is_new) {
    contacts_.clear();
    start_ = motion.start();
    end_ = motion.end;
    stays_.assign(bodies, 0);
    near_distances_.assign(bodies, -1);
    drifts_.assign(bodies, 0);
    return false;
  }
  bool all_stay = true;
  for (std::size_t body = 0; body < bodies; ++body) {
    const auto [first, count] = coordinates_of(motion, body);
    const auto tolerance =
        static_cast<btScalar>(settings::detection::max_cached_move * found_distances[body]);
    stays_[body] =
        near_distances_[body] >= settings::detection::min_cached_distance * found_distances[body] &&
        are_near(&motion.start()[first], &start_[first], count, tolerance) &&
        are_near(&motion.end[first], &end_[first], count, tolerance);
    if (stays_[body]) continue;
    all_stay = false;
    std::copy_n(&motion.start()[first], count, &start_[first]);
    std::copy_n(&motion.end[first], count, &end_[first]);
    near_distances_[body] = -1;  // until take()
    drifts_[body] = 0;
  }
  if (!all_stay) find_drifts(motion);
  return all_stay;
}

void ContactCache::find_drifts(const Motion& motion) {
  for (std::size_t body = 0; body < stays_.size(); ++body) {
    if (!stays_[body]) continue;
    const auto [first, count] = coordinates_of(motion, body);
    const double along_axis = largest_difference(&motion.start()[first], &start_[first], count);
    drifts_[body] = std::max(drifts_[body], std::sqrt(3.0) * along_axis);
  }
}

void ContactCache::take(std::vector<Contact>&& found, Span<const double> near_distances) {
  const auto both_stay = [this](const Contact& contact) {
    return stays_[contact.body_a] && stays_[contact.body_b];
  };
  LAZYCCD_ASSERT(near_distances.size() == stays_.size(), "each body has a distance from others");
  LAZYCCD_ASSERT(std::none_of(found.begin(), found.end(), both_stay),
                 "a detection leaves out the pairs of bodies that stay in place");
  if (std::find(stays_.begin(), stays_.end(), 1) == stays_.end()) contacts_.clear();
  contacts_.erase(std::remove_if(contacts_.begin(), contacts_.end(),
                                 [&](const Contact& contact) { return !both_stay(contact); }),
                  contacts_.end());
  if (contacts_.empty()) {
    contacts_.swap(found);
  } else {
    merged_.resize(contacts_.size() + found.size());
    std::merge(contacts_.begin(), contacts_.end(), found.begin(), found.end(), merged_.begin());
    contacts_.swap(merged_);
  }
  LAZYCCD_ASSERT(are_sorted(contacts_), "kept and found contacts are sorted, none twice");
  for (std::size_t body = 0; body < stays_.size(); ++body)
    if (!stays_[body]) near_distances_[body] = near_distances[body];
}

// A kept pair was last searched when the later of its bodies last moved. The other one had moved by
// its drift, at most, between its own last motion and that search.
bool ContactCache::keeps_apart(const Motion& motion, bool at_start) const {
  Displacements at_starts, at_ends;
  double apart = std::numeric_limits<double>::infinity(), drift = 0;
  for (std::size_t body = 0; body < stays_.size(); ++body) {
    if (!stays_[body]) continue;
    apart = std::min(apart, near_distances_[body]);
    drift = std::max(drift, drifts_[body]);
    const auto [first, count] = coordinates_of(motion, body);
    at_starts.add(&start_[first], &motion.start()[first], count);
    if (!at_start) at_ends.add(&start_[first], &motion.end[first], count);
  }
  const double moved = std::max(at_starts.largest_difference(), at_ends.largest_difference());
  return moved + drift < slack * apart;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
