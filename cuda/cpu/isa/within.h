// Tests for a minimum separation, and the description of contacts, in lanes of double.
#pragma once

#include "cpu/isa/float_lanes.h"
#include "host/kernels/leaf_kernels.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

/// As LeafKernels::within.
int within(const LeafScene& scene, ContactKind kind, Approach* approaches, int count);

/// As LeafKernels::describe.
void describe(const LeafScene& scene, ContactKind kind, const Approach* approaches, int count,
              ContactPlace* places);

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
