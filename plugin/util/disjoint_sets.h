// Disjoint sets (union-find) over the integers 0 to count - 1.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>

#include "lazyccd/bullet/precision.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t size) { reset(size); }

  /// Begins anew, with sets of one element.
  void reset(std::size_t size) {
    parent_.resize(size);
    std::iota(parent_.begin(), parent_.end(), 0);
    count_ = size;
  }

  std::size_t size() const { return parent_.size(); }
  std::size_t count() const { return count_; }  ///< number of sets

  /// The smallest element of the set that holds `i`.
  std::int32_t find(std::int32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }

  /// Merges the sets of `a` and `b`. Returns false if they were one set before.
  bool join(std::int32_t a, std::int32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
    count_ -= a != b;
    return a != b;
  }

 private:
  ScratchVector<std::int32_t> parent_;
  std::size_t count_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
