// Sums over nodes that have the same bits on any number of threads.
#pragma once

#include <LinearMath/btScalar.h>

#include <cstddef>

#include "util/parallel_for.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Nodes in one range. Less work than this takes less time than waking a thread.
constexpr std::size_t node_grain = 1024;

class OrderedSum {
 public:
  /// Returns term(0) + term(1) + ..., added one after the other. The terms themselves are computed
  /// on several threads.
  template <class Term>
  btScalar operator()(const ParallelFor& parallel_for, std::size_t count, const Term& term) {
    terms_.resize(count);
    btScalar sum = 0;
    bool is_done = false;
    for_ranges(parallel_for, count, node_grain, [&](std::size_t first, std::size_t last) {
      if (first == 0 && last == count) {  // the additions wait for each other, not the terms
        btScalar own_sum = 0;
        for (std::size_t i = 0; i < count; ++i) own_sum += term(i);
        sum = own_sum;
        is_done = true;
        return;
      }
      for (std::size_t i = first; i < last; ++i) terms_[i] = term(i);
    });
    if (is_done) return sum;
    for (const btScalar t : terms_) sum += t;
    return sum;
  }

 private:
  ScratchVector<btScalar> terms_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
