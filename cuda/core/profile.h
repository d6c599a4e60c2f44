// Ranges of NVTX: named spans of time that NVIDIA's profilers show, on host and device.
#pragma once

#if defined(LAZYCCD_PROFILE)

#include <nvtx3/nvToolsExt.h>

namespace lazyccd {

/// A range of the calling thread, from its construction to its destruction.
class NvtxRange {
 public:
  explicit NvtxRange(const char* name) { nvtxRangePushA(name); }
  ~NvtxRange() { nvtxRangePop(); }
  NvtxRange(const NvtxRange&) = delete;
  NvtxRange& operator=(const NvtxRange&) = delete;
};

}  // namespace lazyccd

#define LAZYCCD_JOIN_NAMES(a, b) a##b
#define LAZYCCD_NAME_AT(name, line) LAZYCCD_JOIN_NAMES(name, line)

/// Opens a range until the end of the scope; nothing without the CMake option LAZYCCD_PROFILE.
/// For phases of a detection, and not for inner loops.
#define LAZYCCD_NVTX_RANGE(name) \
  const ::lazyccd::NvtxRange LAZYCCD_NAME_AT(range_of_line_, __LINE__)(name)

#else
#define LAZYCCD_NVTX_RANGE(name) static_cast<void>(0)
#endif
