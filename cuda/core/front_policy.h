// When a saved front is worth starting from (dissertation, section 3.3).
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>

namespace lazyccd {

// A front f is outdated once n(f) / n(f - period) < ratio: it no longer grows, so it is likely to be
// deeper than it need be.
class FrontPolicy {
 public:
  FrontPolicy(int period, double ratio)
      : period_(static_cast<std::size_t>(std::max(period, 1))), ratio_(ratio) {}

  // The hierarchy is another one.
  void forget() { sizes_.clear(); }

  // Whether the next traversal starts from the saved front; else from the root.
  bool reuse() const {
    if (sizes_.size() <= period_) return !sizes_.empty();
    return static_cast<double>(sizes_.back()) >= ratio_ * static_cast<double>(sizes_.front());
  }

  // A traversal left a front of `size` pairs.
  void saved(std::size_t size, bool reused) {
    if (!reused) sizes_.clear();
    sizes_.push_back(size);
    if (sizes_.size() > period_ + 1) sizes_.pop_front();
  }

 private:
  std::size_t period_;
  double ratio_;
  std::deque<std::size_t> sizes_;  // of the last steps since the front was made
};

}  // namespace lazyccd
