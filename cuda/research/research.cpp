#include "lazyccd/algorithm.h"

#include "host/extension.h"
#include "research/cpu_extension.h"
#if defined(LAZYCCD_HAS_CUDA)
#include "research/gpu_extension.h"
#endif

namespace lazyccd {

void register_research() {
#if defined(LAZYCCD_HAS_CUDA)
  static const Extension extension{&research::cpu_extension(), &gpu::research::gpu_extension()};
#else
  static const Extension extension{&research::cpu_extension(), nullptr};
#endif
  set_extension(extension);
}

}  // namespace lazyccd
