// Conversion of the caller's positions to packed arrays, and their upload or copy.
#include "gpu/scene/packed_positions.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <type_traits>
#include <utility>

#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/stream_copy.h"

namespace lazyccd::gpu {
namespace {

constexpr std::size_t kGrain = 8192;         // vertices that a worker takes at a time
constexpr std::size_t kPiece = 1u << 18;     // vertices that are copied to the device at a time
constexpr std::size_t kStreamed = 1u << 18;  // from so many vertices on, copies go past the caches
constexpr std::size_t kBlock = 256;          // vertices that are converted at a time then
constexpr std::size_t kSamples = 64;         // vertices that show whether a start is the last end

// Calls body(x, i) for the vertices [first, last). x points to its three scalars as they are
// stored; i is the index of the first one among all scalars. Returns false if any call returned
// false. The loop has no early exit, so that it can be vectorized.
template <class Body>
bool for_each_vertex(const Positions& positions, std::size_t first, std::size_t last, Body&& body) {
  const auto walk = [&](auto scalar) {
    const char* data = static_cast<const char*>(positions.data());
    bool good = true;
    for (std::size_t v = first; v < last; ++v)
      good &= body(reinterpret_cast<const decltype(scalar)*>(data + v * positions.stride()), 3 * v);
    return good;
  };
  return positions.is_double() ? walk(double{}) : walk(float{});
}

// Converts positions to Scalar. Returns whether Scalar holds all of them exactly, as double always
// does. NaN counts as not exact in float; the device finds it later.
template <class Scalar>
bool convert(const Positions& positions, std::size_t first, std::size_t last, Scalar* out) {
  return for_each_vertex(positions, first, last, [&](const auto* x, std::size_t i) {
    bool exact = true;
    for (int k = 0; k < 3; ++k) {
      const auto value = static_cast<Scalar>(x[k]);
      out[i - 3 * first + k] = value;
      if constexpr (std::is_same_v<Scalar, float>)
        exact &= static_cast<std::decay_t<decltype(x[k])>>(value) == x[k];
    }
    return exact;
  });
}

// The same to the packed array `out`, which the device reads next. Large arrays go past the caches.
template <class Scalar>
bool copy(const Positions& positions, std::size_t first, std::size_t last, Scalar* out) {
  if (positions.count() < kStreamed) return convert(positions, first, last, out + 3 * first);
  bool exact = true;
  Scalar block[3 * kBlock];
  for (std::size_t v = first; v < last; v += kBlock) {
    const std::size_t end = std::min(v + kBlock, last);
    exact &= convert(positions, v, end, block);
    stream_copy(out + 3 * v, block, 3 * (end - v) * sizeof(Scalar));
  }
  finish_stream_copies();
  return exact;
}

// Returns whether positions equal the packed array `other` in all bits, so also in the signs of
// zeros.
template <class Scalar>
bool same(const Positions& positions, std::size_t first, std::size_t last, const Scalar* other) {
  return for_each_vertex(positions, first, last, [other](const auto* x, std::size_t i) {
    using Given = std::decay_t<decltype(*x)>;
    const Given y[3] = {static_cast<Given>(other[i]), static_cast<Given>(other[i + 1]),
                        static_cast<Given>(other[i + 2])};
    return std::memcmp(x, y, sizeof(y)) == 0;
  });
}

// Calls body(first, last) for parts of [begin, end), on all threads. Returns whether all calls
// returned true.
template <class Body>
bool all_of(std::size_t begin, std::size_t end, ThreadPool& pool, Body&& body) {
  std::atomic<bool> all_true{true};  // relaxed: the end of the job orders the stores
  pool.parallel_for(end - begin, kGrain, [&](std::size_t first, std::size_t last, int) {
    if (!body(begin + first, begin + last)) all_true.store(false, std::memory_order_relaxed);
  });
  return all_true.load(std::memory_order_relaxed);
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
bool PackedPositions::follows(const Positions& start, const PinnedBuffer<Scalar>& last_end,
                              ThreadPool& pool) {
  const std::size_t count = start.count();
  const auto is_same = [&](std::size_t first, std::size_t last) {
    return same(start, first, last, last_end.data());
  };
  const std::size_t distance = std::max<std::size_t>(count / kSamples, 1);
  for (std::size_t v = 0; v < count; v += distance)
    if (!is_same(v, v + 1)) return false;
  if (!was_mistaken_) return true;
  was_mistaken_ = !all_of(0, count, pool, is_same);
  return !was_mistaken_;
}

template <class Scalar>
bool PackedPositions::upload_as(const Positions& start, const Positions& end,
                                PinnedBuffer<Scalar>& from, PinnedBuffer<Scalar>& to,
                                ThreadPool& pool, cudaStream_t stream) {
  const std::size_t count = start.count();
  from.reserve(3 * count);
  to.reserve(3 * count);
  is_assumed_ = resident_ && follows(start, to, pool);
  if (is_assumed_) {
    from.swap(to);
    LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(start_.data(), end_.data(), 3 * count * sizeof(Scalar),
                                       cudaMemcpyDeviceToDevice, stream));
  }
  const auto send = [&](DeviceBuffer<double>& device, const PinnedBuffer<Scalar>& host,
                        std::size_t first, std::size_t last) {
    LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(reinterpret_cast<Scalar*>(device.data()) + 3 * first,
                                       host.data() + 3 * first, 3 * (last - first) * sizeof(Scalar),
                                       cudaMemcpyHostToDevice, stream));
  };
  for (std::size_t first = 0; first < count; first += kPiece) {
    const std::size_t last = std::min(first + kPiece, count);
    if (!all_of(first, last, pool, [&](std::size_t a, std::size_t b) {
          const bool exact_start = is_assumed_ || copy(start, a, b, from.data());
          return copy(end, a, b, to.data()) && exact_start;
        }))
      return false;
    if (!is_assumed_) send(start_, from, first, last);
    send(end_, to, first, last);
  }
  return true;
}

void PackedPositions::upload(const Positions& start, const Positions& end, ThreadPool& pool,
                             cudaStream_t stream) {
  reserve(3 * start.count());
  if (!is_double_ && !upload_as(start, end, from_float_, to_float_, pool, stream)) {
    is_double_ = true;
    resident_ = false;
    reserve(3 * start.count());
  }
  if (is_double_) upload_as(start, end, from_double_, to_double_, pool, stream);
  resident_ = true;
}

bool PackedPositions::confirm_start(const Positions& start, ThreadPool& pool, cudaStream_t stream) {
  if (!std::exchange(is_assumed_, false)) return true;
  if (all_of(0, start.count(), pool, [&](std::size_t first, std::size_t last) {
        return is_double_ ? same(start, first, last, from_double_.data())
                          : same(start, first, last, from_float_.data());
      }))
    return true;
  was_mistaken_ = true;
  resident_ = false;
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
  return false;
}

}  // namespace lazyccd::gpu
