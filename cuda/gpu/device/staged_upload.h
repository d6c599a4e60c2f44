// Upload of large arrays from ordinary host memory. The driver would copy them on one thread.
#pragma once

#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "gpu/device/check.h"
#include "gpu/device/pinned_buffer.h"
#include "gpu/device/stream.h"
#include "host/threads/thread_pool.h"

namespace lazyccd::gpu {

/// Copies piece by piece to page-locked memory, on all threads, while the device takes the pieces
/// before.
class StagedUpload {
 public:
  /// Enqueues the copy. The array has been read when it returns.
  void copy(void* to, const void* from, std::size_t bytes, ThreadPool& pool, cudaStream_t stream) {
    constexpr std::size_t grain = 1 << 17;
    for (std::size_t first = 0; first < bytes; first += kPiece) {
      const std::size_t size = std::min(kPiece, bytes - first);
      choose_place();
      pieces_[place_].reserve(bytes < kPiece ? bytes : kPiece);
      char* const piece = pieces_[place_].data();
      const char* const source = static_cast<const char*>(from) + first;
      pool.parallel_for(size, grain, [&](std::size_t begin, std::size_t end, int) {
        std::memcpy(piece + begin, source + begin, end - begin);
      });
      LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(static_cast<char*>(to) + first, piece, size,
                                         cudaMemcpyHostToDevice, stream));
      taken_[place_].record(stream);
      used_[place_] = true;
    }
  }

 private:
  static constexpr std::size_t kPiece = std::size_t{1} << 22;
  static constexpr int kPieces = 3;

  // Takes the first place that is free, as it takes milliseconds to lock the memory of one. If none
  // is, waits for one.
  void choose_place() {
    for (int i = 0; i < kPieces; ++i) {
      if (used_[i] && !taken_[i].has_passed()) continue;
      place_ = i;
      return;
    }
    place_ = (place_ + 1) % kPieces;
    taken_[place_].wait();
  }

  PinnedBuffer<char> pieces_[kPieces];
  Event taken_[kPieces];  // the device has read the piece
  bool used_[kPieces] = {};
  int place_ = 0;
};

}  // namespace lazyccd::gpu
