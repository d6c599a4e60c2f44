#include "host/kernels/leaf_kernels.h"

#include <cstring>

namespace lazyccd {

namespace baseline {
extern const LeafKernels kernels;
}
#if defined(LAZYCCD_ISA_X86)
namespace avx2 {
extern const LeafKernels kernels;
}
namespace avx512 {
extern const LeafKernels kernels;
}
#endif

const LeafKernels* leaf_kernels(const char* name) {
#if defined(LAZYCCD_ISA_X86)
  if (!std::strcmp(name, "avx512"))
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                   __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")
               ? &avx512::kernels
               : nullptr;
  if (!std::strcmp(name, "avx2")) return __builtin_cpu_supports("avx2") ? &avx2::kernels : nullptr;
#endif
  return std::strcmp(name, "baseline") ? nullptr : &baseline::kernels;
}

const LeafKernels* best_leaf_kernels() {
  for (const char* name : {"avx512", "avx2"})
    if (const LeafKernels* k = leaf_kernels(name)) return k;
  return &baseline::kernels;
}

}  // namespace lazyccd
