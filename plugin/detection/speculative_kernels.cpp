#include "detection/speculative_kernels.h"

#include "util/isa.h"

namespace lazyccd::bullet {

namespace baseline {
extern const SpeculativeKernels speculative_table;
}
#if defined(LAZYCCD_ISA_X86)
namespace avx2 {
extern const SpeculativeKernels speculative_table;
}
namespace avx512 {
extern const SpeculativeKernels speculative_table;
}
#endif

namespace {

constexpr const SpeculativeKernels* kernels[] = {
#if defined(LAZYCCD_ISA_X86)
    &avx512::speculative_table, &avx2::speculative_table,
#endif
    &baseline::speculative_table};

}  // namespace

const SpeculativeKernels* best_speculative_kernels() { return first_that_runs(kernels); }
const SpeculativeKernels* speculative_kernels(const char* name) { return first_that_runs(kernels, name); }

}  // namespace lazyccd::bullet
