// Makes this program choose its kernels as on a processor with fewer instruction sets.
#pragma once

#include <string>

#include "host/kernels/leaf_kernels.h"
#include "solver/pgs_kernels.h"

#if defined(__x86_64__)
// What __builtin_cpu_supports() reads (libgcc and compiler-rt, cpuinfo). The order of the first 32
// features is part of the ABI.
extern "C" struct CpuModel {
  unsigned vendor, type, subtype, features;
} __cpu_model __attribute__((visibility("hidden")));
#endif

namespace lazyccd::test {

/// While it lives, objects choose the kernels of the named instruction set ("baseline", "avx2",
/// "avx512") or of a smaller one.
class IsaLimit {
 public:
#if defined(__x86_64__)
  explicit IsaLimit(const std::string& name) {
    __builtin_cpu_init();
    features_ = __cpu_model.features;
    if (name != "avx512") __cpu_model.features &= ~(1u << 15);
    if (name == "baseline") __cpu_model.features &= ~(1u << 10);
  }
  ~IsaLimit() { __cpu_model.features = features_; }
#else
  explicit IsaLimit(const std::string&) {}
#endif
  IsaLimit(const IsaLimit&) = delete;
  IsaLimit& operator=(const IsaLimit&) = delete;

  /// Whether detector and adapter choose the kernels of this name.
  static bool chooses(const std::string& name) {
    return best_leaf_kernels()->name == name && bullet::best_pgs_kernels()->name == name;
  }

 private:
  unsigned features_ = 0;
};

}  // namespace lazyccd::test
