// Choice of the link kernels that this processor can run. None without AVX2.
#include "links/link_kernels.h"

#include "util/isa.h"

namespace lazyccd::bullet {

#if defined(LAZYCCD_ISA_X86)

LAZYCCD_ISA_TABLE_AVX2(LinkKernels, link_table)

const LinkKernels* best_link_kernels() { return first_that_runs(link_table_by_isa); }
const LinkKernels* link_kernels(const char* name) {
  return first_that_runs(link_table_by_isa, name);
}

#else

const LinkKernels* best_link_kernels() { return nullptr; }
const LinkKernels* link_kernels(const char*) { return nullptr; }

#endif

}  // namespace lazyccd::bullet
