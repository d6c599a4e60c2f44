#include "detection/speculative_kernels.h"

#include "util/isa.h"

namespace lazyccd::bullet {

namespace baseline {
extern const ProspectKernels prospecting;
}
#if defined(LAZYCCD_ISA_X86)
namespace avx2 {
extern const ProspectKernels prospecting;
}
namespace avx512 {
extern const ProspectKernels prospecting;
}
#endif

namespace {

constexpr const ProspectKernels* kernels[] = {
#if defined(LAZYCCD_ISA_X86)
    &avx512::prospecting, &avx2::prospecting,
#endif
    &baseline::prospecting};

}  // namespace

const ProspectKernels* best_prospect_kernels() { return first_that_runs(kernels); }
const ProspectKernels* prospect_kernels(const char* name) { return first_that_runs(kernels, name); }

}  // namespace lazyccd::bullet
