// Tells which pairs of bodies untangling moves apart, and which it has given up.
//
// Pairs that share a body that moves are a group. A group is given up if none of its pairs makes
// progress for three seconds: bodies that were pushed after that would never come to rest. Progress
// is one intersection less than ever before, or a tenth less depth than at the last progress. A
// pair that was given up stays so until one of its bodies is placed. Groups do not affect each
// other.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class PairProgress {
 public:
  /// What intersects between two bodies at the start of a step.
  struct Found {
    std::size_t count = 0;  ///< of intersections and penetrations
    double depth = 0;       ///< sum over the penetrations, metres
  };
  using FoundPairs = std::map<BodyPair, Found>;
  /// By pair that is moved apart: its group, as the index of a body in it.
  using Groups = std::map<BodyPair, std::int32_t>;

  /// Sets the ids of the bodies, by index. The id of a body stays the same as long as it exists,
  /// its index need not. Without ids the indices are the ids.
  void set_ids(std::vector<int> ids) { ids_ = std::move(ids); }
  /// Says that a body is new or was put elsewhere.
  void place(std::int32_t body);
  /// True if one of the two was placed since forget_placed().
  bool is_placed(std::int32_t a, std::int32_t b) const {
    return placed_.count(id_of(a)) > 0 || placed_.count(id_of(b)) > 0;
  }
  /// Ends an untangling: the pairs that were given up stay known, and nothing else.
  void finish();
  /// Takes what intersects, smaller index first in each pair. `seconds`: since the last call.
  /// `moves`: by body, whether anything moves it. Returns the pairs to be moved apart.
  Groups update(const FoundPairs& found, double seconds, const std::vector<char>& moves);

 private:
  using IdPair = std::pair<int, int>;

  struct Progress {
    std::size_t fewest = std::numeric_limits<std::size_t>::max();  // Found::count in any step
    double last_depth = std::numeric_limits<double>::infinity();   // Found::depth when it last fell
    double seconds_without = 0;  // time since one of them last fell
    bool given_up = false;
  };

  int id_of(std::int32_t body) const {
    return static_cast<std::size_t>(body) < ids_.size() ? ids_[static_cast<std::size_t>(body)]
                                                        : body;
  }
  IdPair ids_of(const BodyPair& pair) const {
    return std::minmax({id_of(pair[0]), id_of(pair[1])});
  }

  std::vector<int> ids_;  // by body
  std::set<int> placed_;  // ids
  std::map<IdPair, Progress> progress_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
