// The exact stage on the device: a thread decides a query that double precision left open with
// narrow integers. A warp decides those that need more bits.
#pragma once

#include "core/exact/decide.h"
#include "core/exact/narrow_integer.h"
#include "gpu/narrow/narrow.cuh"
#include "gpu/narrow/warp_integer.cuh"

namespace lazyccd::gpu {

/// Whether the narrow integers of a thread have overflowed. Blocks have one dimension.
class ThreadOverflow {
 public:
  __device__ static void forget() { flag() = 0; }
  __device__ static void note() { flag() = 1; }
  __device__ static bool noted() { return flag() != 0; }

 private:
  __device__ static unsigned char& flag() {
    __shared__ unsigned char flags[kDecideThreads];
    return flags[threadIdx.x];
  }
};
using ThreadInteger = exact::NarrowInteger<ThreadOverflow>;

/// Decides a query. Adds the contact's share to the hash in the thread that writes it. `writes`:
/// whether this thread does, of those that decide the same query.
template <ContactKind kind, class Integer, class Record>
__device__ __noinline__ Decision::Kind decide_query(const SceneView& scene, const StepLists& lists,
                                                    Candidate pair, bool writes,
                                                    std::uint64_t& hash) {
  Contact contact;
  identify_contact<kind>(scene.mesh, pair, contact);
  const QueryCoordinates q = coordinates<Record>(scene, contact);
  const Decision decision = exact::decide_fixed<kind, Integer>(q);
  if (writes && decision.kind == Decision::hit)
    hash += emit_contact<kind, false>(scene, q, decision.tick, contact, lists);
  return decision.kind;
}

template <class Integer, class Record>
__device__ inline Decision::Kind decide_query(const SceneView& scene, const StepLists& lists,
                                              const HardQuery& query, bool writes,
                                              std::uint64_t& hash) {
  return query.kind == static_cast<std::int32_t>(ContactKind::vertex_face)
             ? decide_query<ContactKind::vertex_face, Integer, Record>(scene, lists, query.pair,
                                                                       writes, hash)
             : decide_query<ContactKind::edge_edge, Integer, Record>(scene, lists, query.pair,
                                                                     writes, hash);
}

/// Decides all queries that double precision left open. Each warp takes as many at a time as there
/// are for it, so that few queries run side by side and not one after another. Those that need more
/// bits than a warp has are listed for the host.
template <class Record>
__global__ void decide_exactly(SceneView scene, StepLists lists) {
  begin_kernel();
  const std::uint32_t count = stored_count(lists.undecided_in_double);
  const int lane = threadIdx.x % kWarp;
  const std::uint32_t warps = gridDim.x * blockDim.x / kWarp;
  const std::uint32_t share = min((count + warps - 1) / warps, static_cast<std::uint32_t>(kWarp));
  std::uint64_t hash = 0;
  for (std::uint32_t first = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp * share; first < count;
       first += warps * share) {
    const std::uint32_t i = first + lane;
    const bool has_query = static_cast<std::uint32_t>(lane) < share && i < count;
    HardQuery query{};
    bool open = false;
    if (has_query) {
      query = lists.undecided_in_double.items[i];
      ThreadOverflow::forget();
      open = decide_query<ThreadInteger, Record>(scene, lists, query, true, hash) ==
             Decision::undecided;
    }
    __syncwarp();
    for (unsigned rest = __ballot_sync(kAllLanes, open); rest != 0; rest &= rest - 1) {
      const int from = __ffs(static_cast<int>(rest)) - 1;
      const HardQuery wide{
          {__shfl_sync(kAllLanes, query.pair.a, from), __shfl_sync(kAllLanes, query.pair.b, from)},
          __shfl_sync(kAllLanes, query.kind, from)};
      const Decision::Kind kind =
          decide_query<WarpInteger, Record>(scene, lists, wide, lane == 0, hash);
      if (lane == 0 && kind == Decision::undecided) append(lists.too_wide, wide);
      __syncwarp();
    }
  }
  add_to_hash(hash, lists.counters);
}

}  // namespace lazyccd::gpu
