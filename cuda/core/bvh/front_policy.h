// Decides when a traversal starts from the saved front (da Silva, section 3.3).
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>

namespace lazyccd {

/// A front f is outdated once n(f) / n(f - period) < ratio: it no longer grows, so it is probably
/// deeper than needed. n(f) is the number of pairs in the front.
class FrontPolicy {
 public:
  FrontPolicy(int period, double ratio)
      : period_(static_cast<std::size_t>(std::max(period, 1))), ratio_(ratio) {}

  /// Discards the history. To be called when the hierarchy has changed.
  void forget() { sizes_.clear(); }

  /// Whether the next traversal starts from the saved front; otherwise it starts from the root.
  bool reuse() const {
    if (sizes_.size() <= period_) return !sizes_.empty();
    return static_cast<double>(sizes_.back()) >= ratio_ * static_cast<double>(sizes_.front());
  }

  /// Records that a traversal left a front of `size` pairs, and whether it had started from a
  /// front.
  void saved(std::size_t size, bool reused) {
    if (!reused) sizes_.clear();
    sizes_.push_back(size);
    if (sizes_.size() > period_ + 1) sizes_.pop_front();
  }

 private:
  std::size_t period_;
  double ratio_;
  std::deque<std::size_t> sizes_;  // front sizes of the last steps since the front was made
};

}  // namespace lazyccd
