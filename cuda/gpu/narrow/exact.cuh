// The exact stage on the device: one warp decides one query that double precision left open.
#pragma once

#include "core/exact/decide.h"
#include "gpu/narrow/narrow.cuh"
#include "gpu/narrow/warp_integer.cuh"

namespace lazyccd::gpu {

/// Decides a query. Returns the contact's share of the hash in lane 0, and 0 in the others.
template <ContactKind kind, class Record>
__device__ __noinline__ std::uint64_t decide_query_exactly(const SceneView& scene,
                                                           const StepLists& lists, Candidate pair,
                                                           int lane) {
  Contact contact;
  identify_contact<kind>(scene.mesh, pair, contact);
  const QueryCoordinates q = coordinates<Record>(scene, contact);
  const Decision decision = exact::decide_fixed<WarpInteger>(kind, q);
  __syncwarp();
  if (lane != 0) return 0;
  if (decision.kind == Decision::undecided)
    append(lists.too_wide, {pair, static_cast<std::int32_t>(kind)});
  if (decision.kind != Decision::hit) return 0;
  return emit_contact<kind, false>(scene, q, decision.tick, contact, lists);
}

/// Decides all queries that double precision left open. Those that need wider integers are listed
/// for the host.
template <class Record>
__global__ void decide_exactly(SceneView scene, StepLists lists) {
  begin_kernel();
  const std::uint32_t count = stored_count(lists.undecided_in_double);
  const int lane = threadIdx.x % kWarp;
  const std::uint32_t warps = gridDim.x * blockDim.x / kWarp;
  std::uint64_t hash = 0;
  for (std::uint32_t i = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp; i < count; i += warps) {
    const HardQuery query = lists.undecided_in_double.items[i];
    hash +=
        query.kind == static_cast<std::int32_t>(ContactKind::vertex_face)
            ? decide_query_exactly<ContactKind::vertex_face, Record>(scene, lists, query.pair, lane)
            : decide_query_exactly<ContactKind::edge_edge, Record>(scene, lists, query.pair, lane);
    __syncwarp();
  }
  add_to_hash(hash, lists.counters);
}

}  // namespace lazyccd::gpu
