// What the filter left to contacts: at the roots in single precision, then in double, one thread a
// query; by subdivision, one warp a query; and the few that only exact arithmetic can decide to a list
// for the host.
#pragma once

#include "core/decision.h"
#include "gpu/leaf.cuh"

namespace lazyccd::gpu {

struct ContactOutput {
  Output<Contact> contacts;  // in no order
  std::uint64_t* keys;       // of the same places: their order (ContactSort)
  Output<HardQuery> hard;
  Output<HardQuery> residue;
  StepCounters* counters;
};

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

__device__ inline std::uint64_t sort_key(const SceneView& scene, const Contact& c) {
  std::uint64_t key = static_cast<std::uint64_t>(c.body_a);
  key = key << scene.body_bits | static_cast<std::uint64_t>(c.body_b);
  key = key << 1 | static_cast<std::uint64_t>(c.kind);
  key = key << scene.a_bits | static_cast<std::uint64_t>(c.primitive_a);
  return key << scene.b_bits | static_cast<std::uint64_t>(c.primitive_b);
}

// Returns the contact's share of the hash.
template <ContactKind kind>
__device__ inline std::uint64_t emit_contact(const SceneView& scene, const QueryCoordinates& q,
                                             std::int64_t tick, Contact& contact,
                                             const ContactOutput& out) {
  contact.toi = static_cast<double>(tick) * kTick;
  describe_contact<kind>(q, contact.toi, false, contact);
  const std::uint32_t slot = atomicAdd(out.contacts.count, 1u);
  if (kind == ContactKind::vertex_face) atomicAdd(&out.counters->contacts_vf, 1u);
  if (slot < out.contacts.capacity) {
    out.contacts.items[slot] = contact;
    out.keys[slot] = sort_key(scene, contact);
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

// The roots in single precision.
template <ContactKind kind, class Record>
__device__ inline void look_at_roots(const SceneView& scene, const Output<Candidate>& filtered,
                                     const Output<Survivor>& survivors, std::uint32_t block,
                                     std::uint32_t blocks) {
  const std::uint32_t count = min(*filtered.count, filtered.capacity);
  const float scale = static_cast<float>(scene_scale(scene));
  const int lane = threadIdx.x % kWarp;
  // Whole warps stay together to the end of the list.
  for (std::uint32_t base = block * blockDim.x; base < count; base += blocks * blockDim.x) {
    const std::uint32_t i = base + threadIdx.x;
    Survivor survivor{};
    bool survives = i < count;
    if (survives) {
      survivor.pair = filtered.items[i];
      const Differences<float> d = gather<kind, Record>(scene, survivor.pair, scale);
      const Magnitudes<float> m = magnitudes(d);
      const Verdict<float> verdict = decide_at_roots<kind>(d, m, coplanarity(d, m));
      survives = !verdict.miss;
      survivor.lo = verdict.hit ? verdict.lo : -1.0f;
      survivor.hi = verdict.hi;
    }
    append_lanes(survivors, survives, survivor, lane);
  }
}

// The blocks of the grid are dealt to the kinds in turn.
template <class Record>
__global__ void filter_at_roots(SceneView scene, Output<Candidate> vf, Output<Candidate> ee,
                                Output<Survivor> vf_survivors, Output<Survivor> ee_survivors) {
  const std::uint32_t block = blockIdx.x / 4, blocks = gridDim.x / 4;
  if (blockIdx.x % 4 == 0) {
    look_at_roots<ContactKind::vertex_face, Record>(scene, vf, vf_survivors, block, blocks);
  } else {
    look_at_roots<ContactKind::edge_edge, Record>(scene, ee, ee_survivors,
                                                  block * 3 + blockIdx.x % 4 - 1, blocks * 3);
  }
}

// Returns the contact's share of the hash, 0 where it is none.
template <ContactKind kind, class Record>
__device__ inline std::uint64_t decide_survivor(const SceneView& scene, const Survivor& s, double scale,
                                                const ContactOutput& out) {
  Contact contact;
  if (!identify<kind>(scene, s.pair, contact)) return 0;
  const QueryCoordinates q = coordinates<Record>(scene, contact);
  const Differences<double> d = differences<kind>(q, scale);
  const Magnitudes<double> m = magnitudes(d);
  const Cubic<double> f = coplanarity(d, m);
  double lo = s.lo, hi = s.hi;
  if (s.lo < 0) {
    atomicAdd(&out.counters->refined, 1u);
    const Verdict<double> v = decide_at_roots<kind>(d, m, f);
    if (v.miss) return 0;
    if (!v.hit) {
      append(out.hard, {s.pair, static_cast<std::int32_t>(kind)});
      return 0;
    }
    lo = v.lo;
    hi = v.hi;
  }
  const std::int64_t tick = impact_tick(f, lo, hi);
  if (tick < 0) {
    append(out.residue, {s.pair, static_cast<std::int32_t>(kind)});
    return 0;
  }
  return emit_contact<kind>(scene, q, tick, contact, out);
}

template <ContactKind kind, class Record>
__device__ inline std::uint64_t decide_list(const SceneView& scene, const Output<Survivor>& survivors,
                                            const ContactOutput& out, std::uint32_t block,
                                            std::uint32_t blocks) {
  const std::uint32_t count = min(*survivors.count, survivors.capacity);
  const double scale = scene_scale(scene);
  std::uint64_t hash = 0;
  for (std::uint32_t i = block * blockDim.x + threadIdx.x; i < count; i += blocks * blockDim.x)
    hash += decide_survivor<kind, Record>(scene, survivors.items[i], scale, out);
  return hash;
}

template <class Record>
__global__ void decide_survivors(SceneView scene, Output<Survivor> vf, Output<Survivor> ee,
                                 ContactOutput out) {
  const std::uint32_t block = blockIdx.x / 4, blocks = gridDim.x / 4;
  const std::uint64_t hash =
      blockIdx.x % 4 == 0
          ? decide_list<ContactKind::vertex_face, Record>(scene, vf, out, block, blocks)
          : decide_list<ContactKind::edge_edge, Record>(scene, ee, out, block * 3 + blockIdx.x % 4 - 1,
                                                        blocks * 3);
  add_to_hash(hash, out.counters);
}

// As decide_by_subdivision (core/subdivision.h), 32 parts at a time: the lanes look at the parts of one
// interval side by side, and the warp goes on into the first part that is not certainly free.
template <ContactKind kind, class Record>
__device__ inline void decide_by_warp(const SceneView& scene, Candidate pair, const ContactOutput& out,
                                      double scale, int lane) {
  Contact contact;
  identify_contact<kind>(scene.mesh, pair, contact);
  const QueryCoordinates q = coordinates<Record>(scene, contact);
  const Differences<double> d = differences<kind>(q, scale);
  const Magnitudes<double> m = magnitudes(d);
  const Cubic<double> f = coplanarity(d, m);

  constexpr int levels = 8;  // down to parts of 2^-40 of the step
  double begin[levels] = {0};
  unsigned open[levels], hits[levels];  // parts still to be looked into; those that hold the contact
  double width = 1.0 / kWarp;
  int level = 0;
  for (int visited = 0; visited < 64; ++visited) {
    const double lo = begin[level] + lane * width, hi = lo + width;
    const Cubic<double> local = f.on(lo, hi);
    const Inside<double> inside = inside_conditions<kind>(d, m, lo + 0.5 * width, 0.5 * width);
    const bool free = local.no_root() || inside.any_negative || separated<kind>(d, m, lo, hi);
    open[level] = __ballot_sync(kAllLanes, !free);
    hits[level] = __ballot_sync(kAllLanes, inside.all_positive && has_one_root(local));
    while (open[level] == 0) {
      if (level == 0) return;
      --level;
      width *= kWarp;
    }
    const int first = __ffs(open[level]) - 1;
    const double first_lo = begin[level] + first * width;
    if (hits[level] >> first & 1) {
      if (lane != 0) return;
      const std::int64_t tick = impact_tick(f, first_lo, first_lo + width);
      if (tick < 0) {
        append(out.residue, {pair, static_cast<std::int32_t>(kind)});
      } else {
        const std::uint64_t share = emit_contact<kind>(scene, q, tick, contact, out);
        atomicAdd(reinterpret_cast<unsigned long long*>(&out.counters->hash),
                  static_cast<unsigned long long>(share));
      }
      return;
    }
    if (level == levels - 1) break;
    open[level] &= ~(1u << first);
    begin[++level] = first_lo;
    width /= kWarp;
  }
  if (lane == 0) append(out.residue, {pair, static_cast<std::int32_t>(kind)});
}

template <class Record>
__global__ void decide_hard(SceneView scene, ContactOutput out) {
  const int lane = threadIdx.x % kWarp;
  const std::uint32_t warps = gridDim.x * blockDim.x / kWarp;
  const std::uint32_t count = min(*out.hard.count, out.hard.capacity);
  const double scale = scene_scale(scene);
  for (std::uint32_t i = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp; i < count; i += warps) {
    const HardQuery query = out.hard.items[i];
    if (query.kind == static_cast<std::int32_t>(ContactKind::vertex_face)) {
      decide_by_warp<ContactKind::vertex_face, Record>(scene, query.pair, out, scale, lane);
    } else {
      decide_by_warp<ContactKind::edge_edge, Record>(scene, query.pair, out, scale, lane);
    }
  }
}

// Contacts to their places. `keys` and `order` are sorted by the upper part of the key, all but
// primitive b; contacts that agree in it are few and find their rank by counting.
__global__ void place_contacts(ContactOutput out, const std::uint64_t* keys, const std::uint32_t* order,
                               int b_bits, Contact* sorted) {
  const std::uint32_t count = min(*out.contacts.count, out.contacts.capacity);
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < count; i += gridDim.x * blockDim.x) {
    const std::uint64_t key = keys[i];
    std::uint32_t place = i;
    for (std::uint32_t j = i; j-- > 0 && keys[j] >> b_bits == key >> b_bits;) place -= keys[j] > key;
    for (std::uint32_t j = i + 1; j < count && keys[j] >> b_bits == key >> b_bits; ++j)
      place += keys[j] < key;
    static_assert(sizeof(Contact) == 4 * sizeof(int4));
    const int4* from = reinterpret_cast<const int4*>(out.contacts.items + order[i]);
    int4* to = reinterpret_cast<int4*>(sorted + place);
    for (int k = 0; k < 4; ++k) to[k] = from[k];
  }
}

__global__ void fill_order(std::uint32_t* order, std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) order[i] = i;
}

}  // namespace lazyccd::gpu
