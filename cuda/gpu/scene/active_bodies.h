// Which bodies a step detects, from the caller's mask of worlds.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "gpu/device/device_buffer.h"
#include "host/scene/mesh.h"

namespace lazyccd::gpu {

/// Flags on the device, one byte per body.
class ActiveBodies {
 public:
  /// Forgets the worlds of the bodies; for another mesh.
  void forget() { has_worlds_ = false; }
  /// Enqueues the flags for a mask on the device: by world, 0 leaves its bodies out. Bodies that
  /// are in every world stay in. Returns the flags.
  const unsigned char* update(const Mesh& mesh, const std::uint8_t* world_mask,
                              cudaStream_t stream);
  std::size_t bytes() const { return worlds_.bytes() + flags_.bytes(); }

 private:
  bool has_worlds_ = false;
  DeviceBuffer<std::int32_t> worlds_;
  DeviceBuffer<unsigned char> flags_;
};

}  // namespace lazyccd::gpu
