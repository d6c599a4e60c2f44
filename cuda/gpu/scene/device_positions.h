// The caller's positions on their way to the device.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>

#include "cpu/threads/thread_pool.h"
#include "gpu/device/device_buffer.h"
#include "gpu/device/pinned_buffer.h"
#include "lazyccd/scene.h"

namespace lazyccd::gpu {

// Packed, and in float where float holds every one of them exactly. In a simulation the end of one
// step is the start of the next: then it is on the device already.
class DevicePositions {
 public:
  // For another mesh.
  void forget() { is_double_ = resident_ = false; }

  // Enqueues the copies. Positions that are not finite count as double.
  void upload(const Positions& start, const Positions& end, ThreadPool& pool, cudaStream_t stream);

  bool is_double() const { return is_double_; }
  // Three scalars a vertex, of the precision that is_double() tells.
  const void* start() const { return start_.data(); }
  const void* end() const { return end_.data(); }
  std::size_t bytes() const { return start_.bytes() + end_.bytes(); }

 private:
  // False where Scalar does not hold one exactly.
  template <class Scalar>
  bool stage(const Positions& start, const Positions& end, PinnedBuffer<Scalar>& from,
             PinnedBuffer<Scalar>& to, ThreadPool& pool);

  bool is_double_ = false, resident_ = false;
  PinnedBuffer<float> from_float_, to_float_;
  PinnedBuffer<double> from_double_, to_double_;
  DeviceBuffer<double> start_, end_;  // room for either precision
};

}  // namespace lazyccd::gpu
