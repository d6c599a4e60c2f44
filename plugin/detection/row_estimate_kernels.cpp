// Choice of the kernels for row estimates that this processor can run.
#include "detection/row_estimate_kernels.h"

#include "util/isa.h"

namespace lazyccd::bullet {

LAZYCCD_ISA_TABLE(RowEstimateKernels, row_estimate_table)

const RowEstimateKernels* best_row_estimate_kernels() {
  return first_that_runs(row_estimate_table_by_isa);
}
const RowEstimateKernels* row_estimate_kernels(const char* name) {
  return first_that_runs(row_estimate_table_by_isa, name);
}

}  // namespace lazyccd::bullet
