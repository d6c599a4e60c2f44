// The protocol between a bench and Bullet's programs, over two pipes: a Request, its data (in) and
// the answer (out). Both sides run on the same machine and come from the same compiler, so the data
// are plain memory images.
//
//   mesh      in: int32 vertices, int32 faces, start and end as 3 float64 a vertex, 3 int32 a face
//             out: nothing
//   pass      out: float64 milliseconds of one pass over the mesh
//   contacts  out: int32 n, then vertex and face of each contact of the last pass, 2 int32 each
//   queries   in: int32 n, then n vertex-face queries of 24 float64
//             out: float64 nanoseconds of all queries, then n bytes, 1 for a hit
#pragma once

#include <cstdint>

namespace lazyccd::bench {

enum class Request : std::int32_t { mesh, pass, contacts, queries };

}  // namespace lazyccd::bench
