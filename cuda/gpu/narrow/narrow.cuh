// What the filter left to contacts: at the roots in single precision, then in double, a lane a
// query; by subdivision, a warp a query; and the few that only exact arithmetic can decide to a
// list for the host.
#pragma once

#include <type_traits>

#include "core/decision.h"
#include "core/separation.h"
#include "gpu/narrow/query.cuh"

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

// Items of a list. Blocks of the same grid may write them too, so not from L1.
template <class T>
__device__ inline std::uint32_t held(const Output<T>& list) {
  return min(__ldcg(list.count), list.capacity);
}

// Up to here a warp for each, by subdivision at once, is faster than all ways to spare it.
struct FewQueries {
  std::uint32_t most;

  __device__ bool are(const Output<Candidate> (&lists)[2]) const {
    return held(lists[0]) + held(lists[1]) <= most;
  }
};

template <class Record>
__global__ void filter_at_roots(SceneView scene, StepLists lists, FewQueries few) {
  begin_kernel();
  if (few.are(lists.filtered)) return;
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

// As decide_by_subdivision (core/subdivision.h), 32 parts at a time: the lanes look at the parts of
// one interval side by side, and the warp goes on into the first part that is not certainly free.
// The same query and the same answer in all lanes.
template <ContactKind kind>
__device__ inline Verdict<double> subdivide(const Differences<double>& d,
                                            const Magnitudes<double>& m, const Cubic<double>& f,
                                            int lane) {
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
      if (level == 0) return {false, true, 0, 0};
      --level;
      width *= kWarp;
      open = __shfl_sync(kAllLanes, held_open, level);
      hits = __shfl_sync(kAllLanes, held_hits, level);
      begin = __shfl_sync(kAllLanes, held_begin, level);
    }
    const int first = __ffs(open) - 1;
    const double first_lo = begin + first * width;
    if (hits >> first & 1) return {true, false, first_lo, first_lo + width};
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
  return {false, false, 0, 0};
}

// What is left to decide, in double and by turns: undecided queries at the roots and then the time
// of all hits, a lane a query; what is hard by subdivision, a warp a query.
enum class Turn { undecided, hits, hard };

// Of a turn: an item is a tile, a warp's worth of queries of one kind, or one hard query.
struct TurnItems {
  std::uint32_t queries_vf, queries_ee;  // in lists by kind
  std::uint32_t count, count_vf;         // the first are vertex-face, where the list is by kind
  std::uint32_t* claimed;
};

// One code for all turns, without copies: a short run spends most of its time on loading it.
template <class Record>
struct Decider {
  const SceneView& scene;
  const StepLists& lists;
  const Output<Candidate> (&undecided)[2];
  bool few;  // undecided queries, so that they are the hard ones
  double scale;
  int lane;
  std::uint64_t hash = 0;

  __device__ static std::uint32_t tiles(std::uint32_t queries) {
    return (queries + kWarp - 1) / kWarp;
  }

  __device__ TurnItems items(Turn turn) const {
    DecideCounters& work = lists.counters->decide;
    if (turn == Turn::hits) {
      const std::uint32_t vf = held(lists.hits[0]), ee = held(lists.hits[1]);
      return {vf, ee, tiles(vf) + tiles(ee), tiles(vf), &work.hits};
    }
    const std::uint32_t vf = held(undecided[0]), ee = held(undecided[1]);
    const std::uint32_t undecided_tiles = few ? 0 : tiles(vf) + tiles(ee);
    if (turn == Turn::undecided) return {vf, ee, undecided_tiles, tiles(vf), &work.undecided};
    // Whoever has claimed an undecided tile runs already, so it will be done.
    while (__ldcg(&work.undecided_done) < undecided_tiles) __nanosleep(100);
    __threadfence();
    return {vf, ee, few ? vf + ee : held(lists.hard), vf, &work.hard};
  }

  __device__ void take(Turn turn, const TurnItems& items, std::uint32_t i) {
    int kind = i < items.count_vf ? 0 : 1;
    bool active = true;
    Survivor s{};
    if (turn == Turn::hard && !few) {
      const HardQuery& from = lists.hard.items[i];
      s.pair = {__ldcg(&from.pair.a), __ldcg(&from.pair.b)};
      kind = __ldcg(&from.kind);
    } else {
      if (kind == 1) i -= items.count_vf;
      if (turn != Turn::hard) i = i * kWarp + lane;
      active = i < (kind == 0 ? items.queries_vf : items.queries_ee);
      if (active && turn == Turn::hits) s = lists.hits[kind].items[i];
      if (active && turn != Turn::hits) s.pair = undecided[kind].items[i];
    }
    if (kind == static_cast<int>(ContactKind::vertex_face)) {
      decide<ContactKind::vertex_face>(turn, active, s);
    } else {
      decide<ContactKind::edge_edge>(turn, active, s);
    }
    if (turn != Turn::undecided) return;
    __threadfence();  // the hard queries, before the count that says that they are there
    __syncwarp();
    if (lane == 0) atomicAdd(&lists.counters->decide.undecided_done, 1u);
  }

  // A query of each lane that is active; where hard, the same in all.
  template <ContactKind kind>
  __device__ void decide(Turn turn, bool active, const Survivor& s) {
    constexpr int k = static_cast<int>(kind);
    Contact contact;
    bool difficult = false;
    if (active && identify<kind>(scene, s.pair, contact)) {
      const QueryCoordinates q = coordinates<Record>(scene, contact);
      const Differences<double> d = differences<kind>(q, scale);
      const Magnitudes<double> m = magnitudes(d);
      const Cubic<double> f = coplanarity(d, m);
      Verdict<double> v{true, false, s.lo, s.hi};
      if (turn == Turn::undecided) v = decide_at_roots<kind>(d, m, f);
      if (turn == Turn::hard) v = subdivide<kind>(d, m, f, lane);
      const bool speaks = turn != Turn::hard || lane == 0;
      difficult = !v.hit && !v.miss && speaks;
      if (v.hit && speaks) {
        const std::int64_t tick = impact_tick(f, v.lo, v.hi);
        if (tick >= 0) {
          hash += emit_contact<kind, false>(scene, q, tick, contact, lists);
        } else {
          append(lists.undecided, {s.pair, k});
        }
      }
    }
    __syncwarp();
    append_lanes(turn == Turn::hard ? lists.undecided : lists.hard, difficult, {s.pair, k}, lane);
  }
};

// All turns by one grid. The hits keep the device busy until the last undecided query is done.
template <class Record>
__global__ void __launch_bounds__(kDecideThreads, kDecideBlocks)
    decide(SceneView scene, StepLists lists, FewQueries few) {
  begin_kernel();
  const int lane = threadIdx.x % kWarp;
  const std::uint32_t warps = gridDim.x * blockDim.x / kWarp;
  const bool unfiltered = few.are(lists.filtered);  // at the roots
  const Output<Candidate>(&undecided)[2] = unfiltered ? lists.filtered : lists.undecided;
  Decider<Record> decider{scene, lists, undecided, few.are(undecided), scene_scale(scene), lane};
#pragma unroll 1
  for (const Turn turn : {Turn::undecided, Turn::hits, Turn::hard}) {
    const TurnItems items = decider.items(turn);
    // One for each warp, the rest as they are free. None of the undecided is a warp's own: its
    // block may have to wait for those that wait for it.
    const std::uint32_t own = turn == Turn::undecided ? 0 : warps;
    const auto claim = [&] {
      std::uint32_t claimed = 0;
      if (lane == 0) claimed = own + atomicAdd(items.claimed, 1u);
      return __shfl_sync(kAllLanes, claimed, 0);
    };
    std::uint32_t i = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
    if (own == 0 && items.count != 0) i = claim();
    while (i < items.count) {
      decider.take(turn, items, i);
      if (items.count <= own) break;
      i = claim();
    }
  }
  add_to_hash(decider.hash, lists.counters);
  if (blockIdx.x != 0 || threadIdx.x != 0) return;
  const std::uint32_t count[2] = {held(undecided[0]), held(undecided[1])};
  lists.counters->double_precision_tests = count[0] + count[1];
  if (unfiltered)
    for (int kind = 0; kind < 2; ++kind) lists.counters->undecided[kind] = count[kind];
}

}  // namespace lazyccd::gpu
