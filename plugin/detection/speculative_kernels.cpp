// Choice of the kernels for speculative contacts that this processor can run.
#include "detection/speculative_kernels.h"

#include "util/isa.h"

namespace lazyccd::bullet {

LAZYCCD_ISA_TABLE(SpeculativeKernels, speculative_table)

const SpeculativeKernels* best_speculative_kernels() {
  return first_that_runs(speculative_table_by_isa);
}
const SpeculativeKernels* speculative_kernels(const char* name) {
  return first_that_runs(speculative_table_by_isa, name);
}

}  // namespace lazyccd::bullet
