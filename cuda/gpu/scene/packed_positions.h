// The positions of a step on the device, from the host or from device memory of the caller.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <utility>
#include <vector>

#include "gpu/device/device_buffer.h"
#include "gpu/device/pinned_buffer.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/device.h"
#include "lazyccd/scene.h"

namespace lazyccd::gpu {

/// The positions of a step on the device, packed. They are in float if float holds every one of
/// them exactly, otherwise in double. In a simulation the end of one step is the start of the next;
/// then it is on the device already. A few vertices show whether that is likely. The others are
/// compared while the device works.
class PackedPositions {
 public:
  /// Forgets the uploaded positions; for another mesh.
  void forget() { is_double_ = resident_ = was_mistaken_ = false; }

  /// Enqueues the copies of both arrays, or takes the last end for the start. A NaN counts as not
  /// exact in float. Once the positions are double, they stay double until forget().
  void upload(const Positions& start, const Positions& end, ThreadPool& pool, cudaStream_t stream);

  /// Returns whether the start on the device is the given one. Must follow upload(). If not, the
  /// work on it has been in vain: it has ended, and the next upload() copies both arrays.
  bool confirm_start(const Positions& start, ThreadPool& pool, cudaStream_t stream);

  /// Enqueues the copies of positions that lie in device memory, both in float or both in double.
  void gather(const DevicePositions& start, const DevicePositions& end, cudaStream_t stream);

  /// Copies the positions of the last step to the host and waits. Valid until the next call.
  std::pair<Positions, Positions> download(std::size_t vertices);

  bool is_double() const { return is_double_; }
  /// Three scalars per vertex, in the precision that is_double() returns.
  const void* start() const { return start_.data(); }
  const void* end() const { return end_.data(); }
  std::size_t bytes() const { return start_.bytes() + end_.bytes(); }

 private:
  // Makes room for so many scalars. Positions that lie there are lost only if the precision
  // changes.
  void reserve(std::size_t values);
  // Whether the start can be taken for the last end. Compares a few vertices, or all of them if
  // the last step was taken for granted in vain.
  template <class Scalar>
  bool follows(const Positions& start, const PinnedBuffer<Scalar>& last_end, ThreadPool& pool);
  // Copies both arrays through pinned memory, piece by piece, while the device takes the pieces
  // before. Returns false if Scalar does not hold every position exactly.
  template <class Scalar>
  bool upload_as(const Positions& start, const Positions& end, PinnedBuffer<Scalar>& from,
                 PinnedBuffer<Scalar>& to, ThreadPool& pool, cudaStream_t stream);

  bool is_double_ = false;
  bool resident_ = false;      // the end of the last step is on the device
  bool is_assumed_ = false;    // the start was taken for it, and confirm_start() has not looked yet
  bool was_mistaken_ = false;  // the last time, that was wrong
  PinnedBuffer<float> from_float_, to_float_;
  PinnedBuffer<double> from_double_, to_double_;
  DeviceBuffer<double> start_, end_;           // of either precision
  std::vector<double> host_start_, host_end_;  // the same, of download()
};

}  // namespace lazyccd::gpu
