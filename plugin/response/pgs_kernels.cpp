#include "response/pgs_kernels.h"

#include "util/isa.h"

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

namespace {

constexpr const SweepKernels* kernels[] = {
#if defined(LAZYCCD_ISA_X86)
    &avx512::sweeping, &avx2::sweeping,
#endif
    &baseline::sweeping};

}  // namespace

const SweepKernels* best_sweep_kernels() { return first_that_runs(kernels); }
const SweepKernels* sweep_kernels(const char* name) { return first_that_runs(kernels, name); }

}  // namespace lazyccd::bullet
