// Computation of the boxes of vertices, primitives and groups.
#pragma once

#include "cpu/isa/float_lanes.h"
#include "host/kernels/leaf_kernels.h"

namespace lazyccd {
namespace LAZYCCD_ISA {

/// As in LeafKernels.
void box_vertices(const double* records, double scale, double margin, std::size_t first,
                  std::size_t last, VertexBox* boxes);
void box_groups(const VertexBox* vertices, const Group* groups, std::size_t first, std::size_t last,
                Block* blocks, MotionBox* boxes);

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
