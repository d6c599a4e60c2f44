// What the filter left to contacts: at the roots in single precision, then in double, a lane a
// query; by subdivision, a warp a query; and the few that only exact arithmetic can decide to a
// list for the host.
#pragma once

#include <type_traits>

#include "core/decision.h"
#include "core/separation.h"
#include "gpu/query.cuh"

namespace lazyccd::gpu {

constexpr int kDecideThreads = 128;
constexpr int kDecideBlocks = 2;  // a multiprocessor: the decisions take all registers

__device__ inline void append(const Output<HardQuery>& output, const HardQuery& query) {
  const std::uint32_t slot = atomicAdd(output.count, 1u);
  if (slot < output.capacity) output.items[slot] = query;
}

// Names the primitives; false where all four vertices are pinned: such a pair is not reported.
template <ContactKind kind>
__device__ inline bool identify(const SceneView& scene, Candidate pair, Contact& contact) {
  identify_contact<kind>(scene.mesh, pair, contact);
  if (!scene.pinned) return true;
  bool all = true;
  for (int i = 0; i < 4; ++i) all = all && scene.pinned[contact.vertices[i]];
  return !all;
}

template <class Record>
__device__ inline QueryCoordinates coordinates(const SceneView& scene, const Contact& contact) {
  QueryCoordinates q;
  for (int i = 0; i < 4; ++i) {
    const Record r = static_cast<const Record*>(scene.records)[contact.vertices[i]];
    q.start[i] = {r.x[0], r.x[1], r.x[2]};
    q.end[i] = {r.x[3], r.x[4], r.x[5]};
  }
  return q;
}

// Returns the contact's share of the hash.
template <ContactKind kind, bool thick>
__device__ inline std::uint64_t emit_contact(const SceneView& scene, const QueryCoordinates& q,
                                             std::int64_t tick, Contact& contact,
                                             const StepLists& lists) {
  contact.toi = static_cast<double>(tick) * kTick;
  describe_contact<kind>(q, contact.toi, thick, contact);
  const std::uint32_t slot = atomicAdd(lists.contacts.count, 1u);
  if (kind == ContactKind::vertex_face) atomicAdd(&lists.counters->contacts_vf, 1u);
  if (slot < lists.contacts.capacity) {
    const std::uint64_t key = scene.key(contact);
    lists.contacts.items[slot] = contact;
    lists.keys[slot] = key;
    if (lists.bins != nullptr)
      lists.ranks[slot] = atomicAdd(lists.bins + (key >> scene.key.b_bits), 1u);
  }
  return hash_share(contact);
}

// One atomic a warp. All lanes call.
__device__ inline void add_to_hash(std::uint64_t share, StepCounters* counters) {
  for (int offset = kWarp / 2; offset > 0; offset /= 2)
    share += __shfl_xor_sync(kAllLanes, share, offset);
  if (threadIdx.x % kWarp == 0 && share != 0)
    atomicAdd(reinterpret_cast<unsigned long long*>(&counters->hash),
              static_cast<unsigned long long>(share));
}

template <ContactKind kind>
using KindConstant = std::integral_constant<ContactKind, kind>;

// The roots in single precision.
template <ContactKind kind, class Record>
__device__ inline void look_at_roots(const SceneView& scene, const StepLists& lists,
                                     std::uint32_t block, std::uint32_t blocks) {
  constexpr int k = static_cast<int>(kind);
  const Output<Candidate>& filtered = lists.filtered[k];
  const std::uint32_t count = min(*filtered.count, filtered.capacity);
  const float scale = static_cast<float>(scene_scale(scene));
  const int lane = threadIdx.x % kWarp;
  // Whole warps stay together to the end of the list.
  for (std::uint32_t base = block * blockDim.x; base < count; base += blocks * blockDim.x) {
    const std::uint32_t i = base + threadIdx.x;
    Survivor survivor{};
    bool hit = false, undecided = false;
    if (i < count) {
      survivor.pair = filtered.items[i];
      const Differences<float> d = gather<kind, Record>(scene, survivor.pair, scale);
      const Magnitudes<float> m = magnitudes(d);
      const Verdict<float> verdict = decide_at_roots<kind>(d, m, coplanarity(d, m));
      hit = verdict.hit;
      undecided = !verdict.hit && !verdict.miss;
      survivor.lo = verdict.lo;
      survivor.hi = verdict.hi;
    }
    append_lanes(lists.hits[k], hit, survivor, lane);
    append_lanes(lists.undecided[k], undecided, survivor.pair, lane);
  }
}

// Of each four blocks one is for the vertex-face candidates and three for the edges, of which there
// are about as many more: calls body(kind, block, blocks) with the place among those of its kind.
template <class Body>
__device__ inline void deal_blocks(Body&& body) {
  const std::uint32_t block = blockIdx.x / 4, blocks = gridDim.x / 4, turn = blockIdx.x % 4;
  if (turn == 0) {
    body(KindConstant<ContactKind::vertex_face>(), block, blocks);
  } else {
    body(KindConstant<ContactKind::edge_edge>(), block * 3 + turn - 1, blocks * 3);
  }
}

template <class Record>
__global__ void filter_at_roots(SceneView scene, StepLists lists) {
  begin_kernel();
  deal_blocks([&](auto kind, std::uint32_t block, std::uint32_t blocks) {
    look_at_roots<kind.value, Record>(scene, lists, block, blocks);
  });
}

// With a minimum separation: all in double, a lane a query.
template <ContactKind kind, class Record>
__device__ inline std::uint64_t decide_within_list(const SceneView& scene, const StepLists& lists,
                                                   std::uint32_t block, std::uint32_t blocks) {
  const Output<Candidate>& filtered = lists.filtered[static_cast<int>(kind)];
  const std::uint32_t count = min(*filtered.count, filtered.capacity);
  const double scale = scene_scale(scene);
  std::uint64_t hash = 0;
  for (std::uint32_t i = block * blockDim.x + threadIdx.x; i < count; i += blocks * blockDim.x) {
    Contact contact;
    if (!identify<kind>(scene, filtered.items[i], contact)) continue;
    const QueryCoordinates q = coordinates<Record>(scene, contact);
    const Decision decision = lazyccd::decide_within<kind>(q, scene.separation, scale);
    if (decision.kind == Decision::hit)
      hash += emit_contact<kind, true>(scene, q, decision.tick, contact, lists);
  }
  return hash;
}

template <class Record>
__global__ void decide_within(SceneView scene, StepLists lists) {
  begin_kernel();
  std::uint64_t hash = 0;
  deal_blocks([&](auto kind, std::uint32_t block, std::uint32_t blocks) {
    hash = decide_within_list<kind.value, Record>(scene, lists, block, blocks);
  });
  add_to_hash(hash, lists.counters);
}

// The time of a query with one root in [lo, hi]. Returns the contact's share of the hash, 0 where
// it went to the residue.
template <ContactKind kind>
__device__ inline std::uint64_t time_hit(const SceneView& scene, const QueryCoordinates& q,
                                         const Cubic<double>& f, double lo, double hi,
                                         Candidate pair, Contact& contact, const StepLists& lists) {
  const std::int64_t tick = impact_tick(f, lo, hi);
  if (tick >= 0) return emit_contact<kind, false>(scene, q, tick, contact, lists);
  append(lists.residue, {pair, static_cast<std::int32_t>(kind)});
  return 0;
}

// As decide_by_subdivision (core/subdivision.h), 32 parts at a time: the lanes look at the parts of
// one interval side by side, and the warp goes on into the first part that is not certainly free.
template <ContactKind kind, class Record>
__device__ inline std::uint64_t decide_by_warp(const SceneView& scene, Candidate pair,
                                               const StepLists& lists, double scale, int lane) {
  Contact contact;
  if (!identify<kind>(scene, pair, contact)) return 0;
  const QueryCoordinates q = coordinates<Record>(scene, contact);
  const Differences<double> d = differences<kind>(q, scale);
  const Magnitudes<double> m = magnitudes(d);
  const Cubic<double> f = coplanarity(d, m);

  // The way down: lane l holds what is known of level l, where each part is 32 of the next.
  constexpr int levels = 4;  // down to parts of 2^-20 of the step
  double held_begin = 0;
  unsigned held_open = 0,
           held_hits = 0;  // parts still to be looked into; those that hold the contact
  double begin = 0, width = 1.0 / kWarp;
  int level = 0;
  for (int visited = 0; visited < 64; ++visited) {
    const double lo = begin + lane * width, hi = lo + width;
    const Cubic<double> local = f.on(lo, hi);
    const Inside<double> inside = inside_conditions<kind>(d, m, lo + 0.5 * width, 0.5 * width);
    const bool free = local.no_root() || inside.any_negative || separated<kind>(d, m, lo, hi);
    unsigned open = __ballot_sync(kAllLanes, !free);
    unsigned hits = __ballot_sync(kAllLanes, inside.all_positive && has_one_root(local));
    while (open == 0) {
      if (level == 0) return 0;
      --level;
      width *= kWarp;
      open = __shfl_sync(kAllLanes, held_open, level);
      hits = __shfl_sync(kAllLanes, held_hits, level);
      begin = __shfl_sync(kAllLanes, held_begin, level);
    }
    const int first = __ffs(open) - 1;
    const double first_lo = begin + first * width;
    if (hits >> first & 1)
      return lane == 0
                 ? time_hit<kind>(scene, q, f, first_lo, first_lo + width, pair, contact, lists)
                 : 0;
    if (level == levels - 1) break;
    if (lane == level) {
      held_open = open & (open - 1);
      held_hits = hits;
      held_begin = begin;
    }
    begin = first_lo;
    ++level;
    width /= kWarp;
  }
  if (lane == 0) append(lists.residue, {pair, static_cast<std::int32_t>(kind)});
  return 0;
}

// All that is left to decide, in double.
template <class Record>
struct Decider {
  const SceneView& scene;
  const StepLists& lists;
  double scale;
  int lane;
  std::uint64_t hash = 0;

  // Calls body(i) for each i < count, shared among all warps: one each, the rest as they are free.
  template <class Body>
  __device__ void share(std::uint32_t count, std::uint32_t& claimed, Body&& body) const {
    const std::uint32_t warps = gridDim.x * blockDim.x / kWarp;
    for (std::uint32_t i = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp; i < count;) {
      body(i);
      if (count <= warps) return;
      if (lane == 0) i = warps + atomicAdd(&claimed, 1u);
      i = __shfl_sync(kAllLanes, i, 0);
    }
  }
  // Written by other blocks of this grid too, so not from L1.
  template <class T>
  __device__ static std::uint32_t held(const Output<T>& list) {
    return min(__ldcg(list.count), list.capacity);
  }
  __device__ static std::uint32_t tiles(std::uint32_t items) { return (items + kWarp - 1) / kWarp; }

  // A tile of one of the lists of survivors, a lane a query: undecided ones at the roots, then the
  // time of all that are hits.
  template <ContactKind kind>
  __device__ void decide_tile(bool undecided, std::uint32_t tile) {
    constexpr int k = static_cast<int>(kind);
    const std::uint32_t i = tile * kWarp + lane;
    Survivor s{};
    bool difficult = false, inside = false;
    if (undecided) {
      inside = i < held(lists.undecided[k]);
      if (inside) s.pair = lists.undecided[k].items[i];
    } else {
      inside = i < held(lists.hits[k]);
      if (inside) s = lists.hits[k].items[i];
    }
    Contact contact;
    if (inside && identify<kind>(scene, s.pair, contact)) {
      const QueryCoordinates q = coordinates<Record>(scene, contact);
      const Differences<double> d = differences<kind>(q, scale);
      const Magnitudes<double> m = magnitudes(d);
      const Cubic<double> f = coplanarity(d, m);
      Verdict<double> v{true, false, s.lo, s.hi};
      if (undecided) v = decide_at_roots<kind>(d, m, f);
      difficult = !v.hit && !v.miss;
      if (v.hit) hash += time_hit<kind>(scene, q, f, v.lo, v.hi, s.pair, contact, lists);
    }
    __syncwarp();
    if (undecided) append_lanes(lists.hard, difficult, {s.pair, k}, lane);
  }

  // Tiles of both kinds.
  __device__ void decide_tiles(bool undecided, std::uint32_t& claimed, std::uint32_t tiles_vf,
                               std::uint32_t tiles) {
    share(tiles, claimed, [&](std::uint32_t tile) {
      if (tile < tiles_vf) {
        decide_tile<ContactKind::vertex_face>(undecided, tile);
      } else {
        decide_tile<ContactKind::edge_edge>(undecided, tile - tiles_vf);
      }
      if (!undecided) return;
      __threadfence();  // the hard queries, before the count that says that they are there
      __syncwarp();
      if (lane == 0) atomicAdd(&lists.counters->decide.undecided_done, 1u);
    });
  }
};

// By one grid: what is undecided, then the time of the hits, then what is hard, by subdivision, a
// warp a query. The hits keep the device busy until the last undecided query is done.
template <class Record>
__global__ void __launch_bounds__(kDecideThreads, kDecideBlocks)
    decide(SceneView scene, StepLists lists) {
  begin_kernel();
  constexpr int vf = 0, ee = 1;
  DecideCounters& work = lists.counters->decide;
  const int lane = threadIdx.x % kWarp;
  Decider<Record> decider{scene, lists, scene_scale(scene), lane};
  const std::uint32_t undecided_vf = decider.held(lists.undecided[vf]);
  const std::uint32_t undecided = undecided_vf + decider.held(lists.undecided[ee]);
  // With so few that a warp for each is faster, they are the hard queries.
  const bool few = undecided <= 2 * gridDim.x * blockDim.x / kWarp;
  const std::uint32_t tiles_vf = decider.tiles(undecided_vf);
  const std::uint32_t tiles = few ? 0 : tiles_vf + decider.tiles(undecided - undecided_vf);
  const std::uint32_t hits_vf = decider.tiles(decider.held(lists.hits[vf]));
  const std::uint32_t hits = hits_vf + decider.tiles(decider.held(lists.hits[ee]));
  for (const bool first : {true, false})
    decider.decide_tiles(first, first ? work.undecided : work.hits, first ? tiles_vf : hits_vf,
                         first ? tiles : hits);

  // The blocks with the last undecided tiles run already, so they will be done.
  while (__ldcg(&work.undecided_done) < tiles) __nanosleep(100);
  __threadfence();
  decider.share(few ? undecided : decider.held(lists.hard), work.hard, [&](std::uint32_t i) {
    HardQuery query;
    if (!few) {
      const HardQuery& from = lists.hard.items[i];
      query = {{__ldcg(&from.pair.a), __ldcg(&from.pair.b)}, __ldcg(&from.kind)};
    } else if (i < undecided_vf) {
      query = {lists.undecided[vf].items[i], vf};
    } else {
      query = {lists.undecided[ee].items[i - undecided_vf], ee};
    }
    decider.hash += query.kind == vf ? decide_by_warp<ContactKind::vertex_face, Record>(
                                           scene, query.pair, lists, decider.scale, lane)
                                     : decide_by_warp<ContactKind::edge_edge, Record>(
                                           scene, query.pair, lists, decider.scale, lane);
    __syncwarp();
  });
  add_to_hash(decider.hash, lists.counters);
  if (blockIdx.x == 0 && threadIdx.x == 0) lists.counters->refined = undecided;
}

}  // namespace lazyccd::gpu
