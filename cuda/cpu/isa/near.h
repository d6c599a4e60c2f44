// Split of candidates by their distance, in single precision.
#pragma once

#include "cpu/isa/float_lanes.h"
#include "host/kernels/leaf_kernels.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

/// As LeafKernels::near_at_start.
void near_at_start(const LeafScene& scene, ContactKind kind, const Candidate* candidates, int count,
                   NearSplit& split);

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
