// The narrow phase on the device: turns filtered candidates into contacts. Candidates are tested at
// the roots in single precision, then in double with one lane per query, then by subdivision with
// one warp per query. The few queries that only exact arithmetic can decide are listed
// (gpu/narrow/exact.cuh).
#pragma once

#include <type_traits>

#include "core/narrow/decision.h"
#include "core/narrow/separation.h"
#include "core/narrow/start_distance.h"
#include "gpu/narrow/query.cuh"

namespace lazyccd::gpu {

constexpr int kDecideThreads = 128;
constexpr int kDecideBlocks = 2;  // per multiprocessor: the decisions use all registers

/// Appends one query to a list.
__device__ inline void append(const Output<HardQuery>& output, const HardQuery& query) {
  const std::uint32_t slot = atomicAdd(output.count, 1u);
  if (slot < output.capacity) output.items[slot] = query;
}

/// Fills in the primitives of a contact. Returns false if all four vertices are pinned; a pair of
/// this kind is not reported.
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

/// Completes a contact and appends it to the list. Returns its share of the hash.
template <ContactKind kind, bool has_separation>
__device__ inline std::uint64_t emit_contact(const SceneView& scene, const QueryCoordinates& q,
                                             std::int64_t tick, Contact& contact,
                                             const StepLists& lists) {
  contact.toi = static_cast<double>(tick) * kTick;
  describe_contact<kind>(q, contact.toi, has_separation, contact);
  const std::uint32_t slot = atomicAdd(lists.contacts.count, 1u);
  if (kind == ContactKind::vertex_face) atomicAdd(&lists.counters->contacts_vf, 1u);
  if (slot < lists.contacts.capacity) {
    const std::uint64_t key = scene.key(contact);
    lists.contacts.items[slot] = contact;
    lists.keys[slot] = key;
    if (lists.upper_keys != nullptr) lists.upper_keys[slot] = scene.key.upper(contact);
    if (lists.bins != nullptr)
      lists.ranks[slot] = atomicAdd(lists.bins + (key >> scene.key.b_bits), 1u);
  }
  return hash_share(contact);
}

/// Adds the shares of a warp to the hash with one atomic operation. All lanes must call it.
__device__ inline void add_to_hash(std::uint64_t share, StepCounters* counters) {
  for (int offset = kWarp / 2; offset > 0; offset /= 2)
    share += __shfl_xor_sync(kAllLanes, share, offset);
  if (threadIdx.x % kWarp == 0 && share != 0)
    atomicAdd(reinterpret_cast<unsigned long long*>(&counters->hash),
              static_cast<unsigned long long>(share));
}

template <ContactKind kind>
using KindConstant = std::integral_constant<ContactKind, kind>;

/// Decides the filtered candidates of one kind at the roots, in single precision.
template <ContactKind kind, class Record>
__device__ inline void filter_list_at_roots(const SceneView& scene, const StepLists& lists,
                                            std::uint32_t block, std::uint32_t blocks) {
  constexpr int k = static_cast<int>(kind);
  const Output<Candidate>& filtered = lists.filtered[k];
  const std::uint32_t count = min(*filtered.count, filtered.capacity);
  const float scale = static_cast<float>(scene_scale(scene));
  const int lane = threadIdx.x % kWarp;
  // Whole warps stay in the loop to the end of the list.
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
    append_lanes(lists.undecided_in_single[k], undecided, survivor.pair, lane);
  }
}

/// Distributes the blocks over the kinds. One block of four takes the vertex-face candidates and
/// three take the edge-edge candidates, which are about three times as many. Calls body(kind,
/// block, blocks) with the block's index among the blocks of its kind.
template <class Body>
__device__ inline void deal_blocks(Body&& body) {
  const std::uint32_t block = blockIdx.x / 4, blocks = gridDim.x / 4, place = blockIdx.x % 4;
  if (place == 0) {
    body(KindConstant<ContactKind::vertex_face>(), block, blocks);
  } else {
    body(KindConstant<ContactKind::edge_edge>(), block * 3 + place - 1, blocks * 3);
  }
}

/// Returns how many items a list holds. Blocks of the same grid may change the count, so it is not
/// read from L1.
template <class T>
__device__ inline std::uint32_t stored_count(const Output<T>& list) {
  return min(__ldcg(list.count), list.capacity);
}

/// Up to max_queries queries, subdividing each one at once, by one warp, is faster than all ways to
/// avoid it.
struct DirectSubdivision {
  std::uint32_t max_queries;

  __device__ bool applies_to(const Output<Candidate> (&lists)[2]) const {
    return stored_count(lists[0]) + stored_count(lists[1]) <= max_queries;
  }
};

/// Decides both lists at the roots in single precision, unless they are short.
template <class Record>
__global__ void filter_at_roots(SceneView scene, StepLists lists, DirectSubdivision direct) {
  begin_kernel();
  if (direct.applies_to(lists.filtered)) return;
  deal_blocks([&](auto kind, std::uint32_t block, std::uint32_t blocks) {
    filter_list_at_roots<kind.value, Record>(scene, lists, block, blocks);
  });
}

/// Whether the caller has left out the pair, or both of its bodies rest.
template <ContactKind kind>
__device__ inline bool is_left_out(const NearView& near, const Contact& contact) {
  if (near.resting[contact.body_a] && near.resting[contact.body_b]) return true;
  if constexpr (kind == ContactKind::vertex_face) {
    return near.vertices_left_out != nullptr && near.vertices_left_out[contact.primitive_a];
  } else {
    return near.edges_left_out != nullptr &&
           (near.edges_left_out[contact.primitive_a] || near.edges_left_out[contact.primitive_b]);
  }
}

/// Records a pair within the separation. Returns whether another pair represents it at the start.
template <ContactKind kind>
__device__ inline bool record_near(const SceneView& scene, const QueryCoordinates& q, double scale,
                                   const Contact& contact, const StepLists& lists) {
  const Candidate pair = {contact.primitive_a, contact.primitive_b};
  const Output<Candidate>& near = lists.near[static_cast<int>(kind)];
  const std::uint32_t slot = atomicAdd(near.count, 1u);
  if (slot < near.capacity) near.items[slot] = pair;

  const DifferencesAt<float> d = differences_at_start<kind>(q, scale);
  const StartDistance<float> at_start = start_distance<kind>(d);
  const double distance = at_start.gap.min_distance<kind>(d) / scale;
  const auto bits = static_cast<unsigned long long>(__double_as_longlong(distance));
  for (const std::int32_t body : {contact.body_a, contact.body_b}) {
    unsigned long long* const least = scene.near.min_distance + body;
    if (bits < __ldcg(least)) atomicMin(least, bits);  // most pairs are not the nearest ones
  }

  return is_redundant_at_start<kind>(scene.mesh, scene.near.first_faces, scene.separation, scale,
                                     pair, at_start);
}

/// Decides the candidates of one kind with a minimum separation: all in double, one lane per query.
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
    if (is_left_out<kind>(scene.near, contact)) continue;
    const QueryCoordinates q = coordinates<Record>(scene, contact);
    const double separation = scene.separation.of<kind>(scene.mesh, filtered.items[i]);
    const Decision decision = lazyccd::decide_within<kind>(q, separation, scale);
    if (decision.kind != Decision::hit) continue;
    const bool is_redundant = record_near<kind>(scene, q, scale, contact, lists);
    if (!(is_redundant && decision.tick == 0))
      hash += emit_contact<kind, true>(scene, q, decision.tick, contact, lists);
  }
  return hash;
}

/// Decides all candidates with a minimum separation.
template <class Record>
__global__ void decide_within(SceneView scene, StepLists lists) {
  begin_kernel();
  std::uint64_t hash = 0;
  deal_blocks([&](auto kind, std::uint32_t block, std::uint32_t blocks) {
    hash = decide_within_list<kind.value, Record>(scene, lists, block, blocks);
  });
  add_to_hash(hash, lists.counters);
}

/// Decides a query as decide_by_subdivision() does (core/narrow/subdivision.h), 32 parts at a time.
/// The lanes test the parts of one interval in parallel. The warp then continues in the first part
/// that is not certainly free. Query and answer are the same in all lanes.
template <ContactKind kind>
__device__ inline Verdict<double> subdivide(const Differences<double>& d,
                                            const Magnitudes<double>& m, const Cubic<double>& f,
                                            int lane) {
  // The path down: lane l holds the state of level l. Each part of a level has 32 parts on the
  // next.
  constexpr int levels = 4;  // down to parts of 2^-20 of the step
  double held_begin = 0;
  unsigned held_open = 0,
           held_hits = 0;  // parts left to test; parts that hold the contact
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

/// Phases of the decide kernel, all in double precision. undecided: the queries that single
/// precision left, at the roots, one lane per query. hits: the time of impact of all hits, one lane
/// per query. hard: the remaining queries by subdivision, one warp per query.
enum class Phase { undecided, hits, hard };

/// The items of a phase. An item is a tile, which is a warp's worth of queries of one kind, or one
/// hard query.
struct PhaseItems {
  std::uint32_t queries_vf, queries_ee;  // in the lists by kind
  std::uint32_t count, count_vf;         // items; vertex-face ones first, if the lists are by kind
  std::uint32_t* claimed;
};

/// Decides items of all phases with one copy of the code. A short run spends most of its time on
/// loading code.
template <class Record>
struct Decider {
  const SceneView& scene;
  const StepLists& lists;
  const Output<Candidate> (&undecided)[2];
  bool subdivide_directly;  // few undecided queries: all count as hard
  double scale;
  int lane;
  std::uint64_t hash = 0;

  __device__ static std::uint32_t tiles(std::uint32_t queries) {
    return (queries + kWarp - 1) / kWarp;
  }

  __device__ PhaseItems items(Phase phase) const {
    DecideCounters& work = lists.counters->decide;
    if (phase == Phase::hits) {
      const std::uint32_t vf = stored_count(lists.hits[0]), ee = stored_count(lists.hits[1]);
      return {vf, ee, tiles(vf) + tiles(ee), tiles(vf), &work.hits};
    }
    const std::uint32_t vf = stored_count(undecided[0]), ee = stored_count(undecided[1]);
    const std::uint32_t undecided_tiles = subdivide_directly ? 0 : tiles(vf) + tiles(ee);
    if (phase == Phase::undecided) return {vf, ee, undecided_tiles, tiles(vf), &work.undecided};
    // A warp that has claimed an undecided tile is running already, so the tile will be done.
    while (__ldcg(&work.undecided_done) < undecided_tiles) __nanosleep(100);
    __threadfence();
    return {vf, ee, subdivide_directly ? vf + ee : stored_count(lists.hard), vf, &work.hard};
  }

  __device__ void take(Phase phase, const PhaseItems& items, std::uint32_t i) {
    int kind = i < items.count_vf ? 0 : 1;
    bool active = true;
    Survivor s{};
    if (phase == Phase::hard && !subdivide_directly) {
      const HardQuery& from = lists.hard.items[i];
      s.pair = {__ldcg(&from.pair.a), __ldcg(&from.pair.b)};
      kind = __ldcg(&from.kind);
    } else {
      if (kind == 1) i -= items.count_vf;
      if (phase != Phase::hard) i = i * kWarp + lane;
      active = i < (kind == 0 ? items.queries_vf : items.queries_ee);
      if (active && phase == Phase::hits) s = lists.hits[kind].items[i];
      if (active && phase != Phase::hits) s.pair = undecided[kind].items[i];
    }
    if (kind == static_cast<int>(ContactKind::vertex_face)) {
      decide<ContactKind::vertex_face>(phase, active, s);
    } else {
      decide<ContactKind::edge_edge>(phase, active, s);
    }
    if (phase != Phase::undecided) return;
    __threadfence();  // the hard queries become visible before the count of done tiles
    __syncwarp();
    if (lane == 0) atomicAdd(&lists.counters->decide.undecided_done, 1u);
  }

  /// Decides one query per active lane. In phase `hard` all lanes have the same query.
  template <ContactKind kind>
  __device__ void decide(Phase phase, bool active, const Survivor& s) {
    constexpr int k = static_cast<int>(kind);
    Contact contact;
    bool difficult = false;
    if (active && identify<kind>(scene, s.pair, contact)) {
      const QueryCoordinates q = coordinates<Record>(scene, contact);
      const Differences<double> d = differences<kind>(q, scale);
      const Magnitudes<double> m = magnitudes(d);
      const Cubic<double> f = coplanarity(d, m);
      Verdict<double> v{true, false, s.lo, s.hi};
      if (phase == Phase::undecided) v = decide_at_roots<kind>(d, m, f);
      if (phase == Phase::hard) v = subdivide<kind>(d, m, f, lane);
      const bool writes = phase != Phase::hard || lane == 0;
      difficult = !v.hit && !v.miss && writes;
      if (v.hit && writes) {
        const std::int64_t tick = impact_tick(f, v.lo, v.hi);
        if (tick >= 0) {
          hash += emit_contact<kind, false>(scene, q, tick, contact, lists);
        } else {
          append(lists.undecided_in_double, {s.pair, k});
        }
      }
    }
    __syncwarp();
    append_lanes(phase == Phase::hard ? lists.undecided_in_double : lists.hard, difficult,
                 {s.pair, k}, lane);
  }
};

/// Runs all phases in one grid. The hits keep the device busy until the last undecided query is
/// done.
template <class Record>
__global__ void __launch_bounds__(kDecideThreads, kDecideBlocks)
    decide(SceneView scene, StepLists lists, DirectSubdivision direct) {
  begin_kernel();
  const int lane = threadIdx.x % kWarp;
  const std::uint32_t warps = gridDim.x * blockDim.x / kWarp;
  const bool unfiltered = direct.applies_to(lists.filtered);  // filter_at_roots() did nothing
  const Output<Candidate>(&undecided)[2] = unfiltered ? lists.filtered : lists.undecided_in_single;
  Decider<Record> decider{scene, lists, undecided, direct.applies_to(undecided), scene_scale(scene),
                          lane};
#pragma unroll 1
  for (const Phase phase : {Phase::undecided, Phase::hits, Phase::hard}) {
    const PhaseItems items = decider.items(phase);
    // Each warp has one item of its own and claims the others when it is free. Undecided tiles are
    // all claimed: a block may have to wait for the blocks that would wait for its own tile.
    const std::uint32_t own = phase == Phase::undecided ? 0 : warps;
    const auto claim = [&] {
      std::uint32_t claimed = 0;
      if (lane == 0) claimed = own + atomicAdd(items.claimed, 1u);
      return __shfl_sync(kAllLanes, claimed, 0);
    };
    std::uint32_t i = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
    if (own == 0 && items.count != 0) i = claim();
    while (i < items.count) {
      decider.take(phase, items, i);
      if (items.count <= own) break;
      i = claim();
    }
  }
  add_to_hash(decider.hash, lists.counters);
  if (blockIdx.x != 0 || threadIdx.x != 0) return;
  const std::uint32_t count[2] = {stored_count(undecided[0]), stored_count(undecided[1])};
  lists.counters->double_precision_tests = count[0] + count[1];
  if (unfiltered)
    for (int kind = 0; kind < 2; ++kind) lists.counters->undecided_in_single[kind] = count[kind];
}

}  // namespace lazyccd::gpu
