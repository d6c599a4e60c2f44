#include "links/link_kernels.h"

#include "util/isa.h"

namespace lazyccd::bullet {

#if defined(LAZYCCD_ISA_X86)

namespace baseline {
extern const LinkKernels link_table;
}
namespace avx2 {
extern const LinkKernels link_table;
}

namespace {

constexpr const LinkKernels* kernels[] = {&avx2::link_table, &baseline::link_table};

}  // namespace

const LinkKernels* best_link_kernels() { return first_that_runs(kernels); }
const LinkKernels* link_kernels(const char* name) { return first_that_runs(kernels, name); }

#else

const LinkKernels* best_link_kernels() { return nullptr; }
const LinkKernels* link_kernels(const char*) { return nullptr; }

#endif

}  // namespace lazyccd::bullet
