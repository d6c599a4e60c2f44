// The positions of a vertex as the CPU backend keeps them.
#pragma once

namespace lazyccd {

/// Positions of a vertex in one step: start x y z, end x y z, two unused. One cache line.
struct alignas(64) VertexRecord {
  double x[8];
};

}  // namespace lazyccd
