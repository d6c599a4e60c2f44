#include "response/pgs_kernels.h"

#include "util/isa.h"

namespace lazyccd::bullet {

namespace baseline {
extern const PgsKernels pgs_table;
}
#if defined(LAZYCCD_ISA_X86)
namespace avx2 {
extern const PgsKernels pgs_table;
}
namespace avx512 {
extern const PgsKernels pgs_table;
}
#endif

namespace {

constexpr const PgsKernels* kernels[] = {
#if defined(LAZYCCD_ISA_X86)
    &avx512::pgs_table, &avx2::pgs_table,
#endif
    &baseline::pgs_table};

}  // namespace

const PgsKernels* best_pgs_kernels() { return first_that_runs(kernels); }
const PgsKernels* pgs_kernels(const char* name) { return first_that_runs(kernels, name); }

}  // namespace lazyccd::bullet
