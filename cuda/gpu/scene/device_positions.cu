// Conversion of the caller's positions to packed arrays, and their upload.
#include "gpu/scene/device_positions.h"

#include <algorithm>
#include <atomic>

#include "gpu/device/check.h"

namespace lazyccd::gpu {
namespace {

constexpr std::size_t kGrain = 8192;  // vertices that a worker takes at a time

// Calls body(x, i) for every vertex. x points to its three scalars as they are stored; i is the
// index of the first one among all scalars. Returns false if any call returned false. The loop has
// no early exit, so that it can be vectorized.
template <class Body>
bool for_each_vertex(const Positions& positions, ThreadPool& pool, Body&& body) {
  std::atomic<bool> all_true{true};  // relaxed: the end of the job orders the stores
  pool.parallel_for(positions.count(), kGrain, [&](std::size_t first, std::size_t last, int) {
    const auto walk = [&](auto scalar) {
      const char* data = static_cast<const char*>(positions.data());
      bool good = true;
      for (std::size_t v = first; v < last; ++v)
        good &=
            body(reinterpret_cast<const decltype(scalar)*>(data + v * positions.stride()), 3 * v);
      return good;
    };
    if (!(positions.is_double() ? walk(double{}) : walk(float{})))
      all_true.store(false, std::memory_order_relaxed);
  });
  return all_true.load(std::memory_order_relaxed);
}

// Converts the positions to Scalar. Returns whether Scalar holds all of them exactly. NaN is not
// equal to itself, so it counts as inexact; the device finds it later.
template <class Scalar>
bool copy(const Positions& positions, Scalar* out, ThreadPool& pool) {
  return for_each_vertex(positions, pool, [out](const auto* x, std::size_t i) {
    bool exact = true;
    for (int k = 0; k < 3; ++k) {
      out[i + k] = static_cast<Scalar>(x[k]);
      exact &= static_cast<std::decay_t<decltype(x[k])>>(out[i + k]) == x[k];
    }
    return exact;
  });
}

// Returns whether the positions equal the packed array `other`.
template <class Scalar>
bool same(const Positions& positions, const Scalar* other, ThreadPool& pool) {
  // If the scene was moved, the first vertex usually shows it, and the others need no test.
  if (positions.count() == 0) return true;
  const std::array<double, 3> first = positions[0];
  for (int k = 0; k < 3; ++k)
    if (first[k] != static_cast<double>(other[k])) return false;
  return for_each_vertex(positions, pool, [other](const auto* x, std::size_t i) {
    bool equal = true;
    for (int k = 0; k < 3; ++k)
      equal &= static_cast<std::decay_t<decltype(x[k])>>(other[i + k]) == x[k];
    return equal;
  });
}

}  // namespace

template <class Scalar>
bool DevicePositions::stage(const Positions& start, const Positions& end,
                            PinnedBuffer<Scalar>& from, PinnedBuffer<Scalar>& to,
                            ThreadPool& pool) {
  from.reserve(3 * start.count());
  to.reserve(3 * start.count());
  resident_ = resident_ && same(start, to.data(), pool);
  const bool exact_start = resident_ || copy(start, from.data(), pool);
  return copy(end, to.data(), pool) && exact_start;
}

void DevicePositions::upload(const Positions& start, const Positions& end, ThreadPool& pool,
                             cudaStream_t stream) {
  if (!is_double_ && !stage(start, end, from_float_, to_float_, pool)) {
    is_double_ = true;
    resident_ = false;
  }
  if (is_double_) stage(start, end, from_double_, to_double_, pool);
  const std::size_t values = 3 * start.count();
  const std::size_t size = values * (is_double_ ? sizeof(double) : sizeof(float));
  start_.reserve(std::max<std::size_t>(values, 1));
  end_.reserve(std::max<std::size_t>(values, 1));
  const void* from =
      is_double_ ? static_cast<const void*>(from_double_.data()) : from_float_.data();
  const void* to = is_double_ ? static_cast<const void*>(to_double_.data()) : to_float_.data();
  LAZYCCD_CUDA_CHECK(
      resident_
          ? cudaMemcpyAsync(start_.data(), end_.data(), size, cudaMemcpyDeviceToDevice, stream)
          : cudaMemcpyAsync(start_.data(), from, size, cudaMemcpyHostToDevice, stream));
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(end_.data(), to, size, cudaMemcpyHostToDevice, stream));
  resident_ = true;
}

}  // namespace lazyccd::gpu
