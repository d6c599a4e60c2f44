// Choice of the contact solver kernels that this processor can run.
#include "solver/pgs_kernels.h"

#include "util/isa.h"

namespace lazyccd::bullet {

LAZYCCD_ISA_TABLE(PgsKernels, pgs_table)

const PgsKernels* best_pgs_kernels() { return first_that_runs(pgs_table_by_isa); }
const PgsKernels* pgs_kernels(const char* name) { return first_that_runs(pgs_table_by_isa, name); }

}  // namespace lazyccd::bullet
