#include "sweep.h"

#include <cstring>
#include <initializer_list>

namespace lazyccd::bullet {

namespace baseline {
extern const SweepKernels sweeping;
}
#if defined(LAZYCCD_ISA_X86)
namespace avx2 {
extern const SweepKernels sweeping;
}
namespace avx512 {
extern const SweepKernels sweeping;
}
#endif

const SweepKernels* sweep_kernels(const char* name) {
#if defined(LAZYCCD_ISA_X86)
  if (!std::strcmp(name, "avx512"))
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")
               ? &avx512::sweeping
               : nullptr;
  if (!std::strcmp(name, "avx2")) return __builtin_cpu_supports("avx2") ? &avx2::sweeping : nullptr;
#endif
  return std::strcmp(name, "baseline") ? nullptr : &baseline::sweeping;
}

const SweepKernels* best_sweep_kernels() {
  for (const char* name : {"avx512", "avx2"})
    if (const SweepKernels* kernels = sweep_kernels(name)) return kernels;
  return &baseline::sweeping;
}

}  // namespace lazyccd::bullet
