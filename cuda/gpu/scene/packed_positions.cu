// Conversion of the caller's positions to packed arrays, and their upload or copy.
#include "gpu/scene/packed_positions.h"

#include <algorithm>
#include <atomic>

#include "gpu/device/kernel_chain.cuh"

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

// Packs the positions of both ends, one thread per vertex.
template <class Scalar>
__global__ void pack(const char* start, std::size_t start_stride, const char* end,
                     std::size_t end_stride, std::uint32_t count, Scalar* packed_start,
                     Scalar* packed_end) {
  const std::uint32_t v = blockIdx.x * blockDim.x + threadIdx.x;
  if (v >= count) return;
  const auto* from = reinterpret_cast<const Scalar*>(start + v * start_stride);
  const auto* to = reinterpret_cast<const Scalar*>(end + v * end_stride);
  for (int k = 0; k < 3; ++k) {
    packed_start[std::size_t{3} * v + k] = from[k];
    packed_end[std::size_t{3} * v + k] = to[k];
  }
}

template <class Scalar>
void enqueue_pack(const DevicePositions& start, const DevicePositions& end, double* packed_start,
                  double* packed_end, cudaStream_t stream) {
  const auto count = static_cast<std::uint32_t>(start.count());
  pack<<<blocks_for(count, 256), 256, 0, stream>>>(
      static_cast<const char*>(start.data()), start.stride(), static_cast<const char*>(end.data()),
      end.stride(), count, reinterpret_cast<Scalar*>(packed_start),
      reinterpret_cast<Scalar*>(packed_end));
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
}

}  // namespace

void PackedPositions::gather(const DevicePositions& start, const DevicePositions& end,
                             cudaStream_t stream) {
  resident_ = false;
  is_double_ = start.is_double();
  reserve(3 * start.count());
  if (is_double_) {
    enqueue_pack<double>(start, end, start_.data(), end_.data(), stream);
  } else {
    enqueue_pack<float>(start, end, start_.data(), end_.data(), stream);
  }
}

std::pair<Positions, Positions> PackedPositions::download(std::size_t vertices) {
  const std::size_t values = 3 * vertices;
  const std::size_t size = values * (is_double_ ? sizeof(double) : sizeof(float));
  host_start_.resize(values);
  host_end_.resize(values);
  LAZYCCD_CUDA_CHECK(cudaMemcpy(host_start_.data(), start_.data(), size, cudaMemcpyDeviceToHost));
  LAZYCCD_CUDA_CHECK(cudaMemcpy(host_end_.data(), end_.data(), size, cudaMemcpyDeviceToHost));
  if (is_double_) return {{host_start_.data(), vertices}, {host_end_.data(), vertices}};
  return {{reinterpret_cast<const float*>(host_start_.data()), vertices},
          {reinterpret_cast<const float*>(host_end_.data()), vertices}};
}

void PackedPositions::reserve(std::size_t values) {
  const std::size_t doubles = is_double_ ? values : (values + 1) / 2;
  start_.reserve(std::max<std::size_t>(doubles, 1));
  end_.reserve(std::max<std::size_t>(doubles, 1));
}

template <class Scalar>
bool PackedPositions::stage(const Positions& start, const Positions& end,
                            PinnedBuffer<Scalar>& from, PinnedBuffer<Scalar>& to,
                            ThreadPool& pool) {
  from.reserve(3 * start.count());
  to.reserve(3 * start.count());
  resident_ = resident_ && same(start, to.data(), pool);
  const bool exact_start = resident_ || copy(start, from.data(), pool);
  return copy(end, to.data(), pool) && exact_start;
}

void PackedPositions::upload(const Positions& start, const Positions& end, ThreadPool& pool,
                             cudaStream_t stream) {
  if (!is_double_ && !stage(start, end, from_float_, to_float_, pool)) {
    is_double_ = true;
    resident_ = false;
  }
  if (is_double_) stage(start, end, from_double_, to_double_, pool);
  const std::size_t values = 3 * start.count();
  const std::size_t size = values * (is_double_ ? sizeof(double) : sizeof(float));
  reserve(values);
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
