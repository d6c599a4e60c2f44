#include "bodies/conjugate_residual.h"

#include <algorithm>
#include <mutex>

#include "bodies/ordered_sum.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Largest value of the nodes from `first` on. After a NaN it starts again.
struct Largest {
  std::size_t first = 0;
  btScalar value = 0;
  bool after_nan = false;

  void add(btScalar x) {
    after_nan = after_nan || x != x;
    value = value > x ? value : x;
  }
};

// Largest absolute value of a component of residual(i), as Bullet finds it: what comes before a NaN
// is forgotten.
template <class Residual>
btScalar largest(const ParallelFor& parallel_for, std::size_t count, const Residual& residual) {
  ScratchVector<Largest> ranges;
  std::mutex adding;
  for_ranges(parallel_for, count, node_grain, [&](std::size_t first, std::size_t last) {
    Largest found;
    found.first = first;
    for (std::size_t i = first; i < last; ++i) {
      const btVector3& r = residual(i);
      for (int k = 0; k < 3; ++k) found.add(btFabs(r[k]));
    }
    const std::lock_guard<std::mutex> lock(adding);
    ranges.push_back(found);
  });
  std::sort(ranges.begin(), ranges.end(),
            [](const Largest& a, const Largest& b) { return a.first < b.first; });
  btScalar value = 0;
  for (const Largest& range : ranges)
    value = !range.after_nan && value > range.value ? value : range.value;
  return value;
}

}  // namespace

void ConjugateResidual::resize(int size) {
  for (VectorStack* vectors : {&r_, &p_, &a_p_, &a_r_, &other_x_}) vectors->resize(size);
}

void ConjugateResidual::solve(Span<const int> unknowns, const Multiply& multiply,
                              const VectorStack& preconditioner, const VectorStack& b,
                              VectorStack& x, int max_iterations, btScalar tolerance,
                              const ParallelFor& parallel_for) {
  const std::size_t count = unknowns.size();
  const auto at = [&unknowns](auto& vectors, std::size_t i) -> auto& {
    return vectors[unknowns[i]];
  };
  OrderedSum sum;

  multiply(x, a_r_);
  const btScalar first_norm = largest(parallel_for, count, [&](std::size_t i) -> const btVector3& {
    return at(p_, i) = at(r_, i) = (at(b, i) - at(a_r_, i)) * at(preconditioner, i);
  });
  if (first_norm <= tolerance) return;
  multiply(p_, a_p_);
  btScalar r_a_r = sum(parallel_for, count, [&](std::size_t i) {
    at(a_r_, i) = at(a_p_, i);
    return at(r_, i).dot(at(a_r_, i));
  });
  btScalar beta = 0;
  // The best solution so far is in other_x_, in x, or there is none yet.
  btScalar best_norm = SIMD_INFINITY;
  bool is_x_best = false, is_other_best = false;
  for (int k = 1; k <= max_iterations; ++k) {
    const btScalar alpha = r_a_r / sum(parallel_for, count, [&](std::size_t i) {
                             btVector3& ap = at(a_p_, i);
                             if (k > 1) {
                               btVector3& p = at(p_, i);
                               p = beta * p + at(r_, i);
                               ap = beta * ap + at(a_r_, i);
                             }
                             return ap.dot(ap * at(preconditioner, i));
                           });
    const bool keeps_x = is_x_best;
    is_other_best = is_other_best || is_x_best;
    is_x_best = false;
    const btScalar norm = largest(parallel_for, count, [&](std::size_t i) -> const btVector3& {
      if (keeps_x) at(other_x_, i) = at(x, i);
      at(x, i) += alpha * at(p_, i);
      btVector3& r = at(r_, i);
      r += -alpha * (at(a_p_, i) * at(preconditioner, i));
      return r;
    });
    if (norm < best_norm) {
      is_x_best = true;
      is_other_best = false;
      best_norm = norm;
      if (norm < tolerance) return;
    }
    multiply(r_, a_r_);
    const btScalar next =
        sum(parallel_for, count, [&](std::size_t i) { return at(r_, i).dot(at(a_r_, i)); });
    beta = next / r_a_r;
    r_a_r = next;
  }
  if (!is_other_best) return;
  for (std::size_t i = 0; i < count; ++i) at(x, i) = at(other_x_, i);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
