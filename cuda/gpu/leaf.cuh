// The leaf kernel: a warp a pair of groups. It keeps the primitives of each that come near the other,
// tests the rest pairwise, and filters what may touch, 32 candidates at a time, without ever writing a
// candidate to memory.
#pragma once

#include "core/node_pair.h"
#include "core/roots.h"
#include "gpu/refit.cuh"

namespace lazyccd::gpu {

constexpr int kMaxPrimitives = 48;  // of one kind in a group
constexpr int kLeafWarps = 4;       // a block

// The primitives of one group that come near the other, side by side.
struct Side {
  float lo0[3][kMaxPrimitives], hi0[3][kMaxPrimitives];
  float lo1[3][kMaxPrimitives], hi1[3][kMaxPrimitives];
  std::int32_t id[kMaxPrimitives];
  std::int32_t vertex[3][kMaxPrimitives];
};

// A warp's shared memory.
struct LeafScratch {
  Side a, b;
  Candidate queue[2][2 * kWarp];  // by ContactKind; less than a warp's worth between pushes
};

__device__ inline bool apart(const MotionBox& a, const MotionBox& b) {
  bool result = false;
  for (int k = 0; k < 3; ++k)
    result |= (a.lo0[k] > b.hi0[k] && a.lo1[k] > b.hi1[k]) ||
              (a.hi0[k] < b.lo0[k] && a.hi1[k] < b.lo1[k]);
  return result;
}

template <class Boxes>
__device__ inline MotionBox box_of(const Boxes& b, int i) {
  MotionBox box;
  for (int k = 0; k < 3; ++k) {
    box.lo0[k] = b.lo0[k][i];
    box.hi0[k] = b.hi0[k][i];
    box.lo1[k] = b.lo1[k][i];
    box.hi1[k] = b.hi1[k][i];
  }
  return box;
}

__device__ inline unsigned lanes_below(int lane) { return (1u << lane) - 1; }

// Puts the group's primitives of one kind that come near `other` into `side`; returns how many.
__device__ inline int collect(const SceneView& scene, const Group& group, int kind,
                              const MotionBox& other, Side& side, int lane) {
  int count = 0;
  for (int base = 0; base < group.count[kind]; base += kWarp) {
    const int i = base + lane;
    bool near = i < group.count[kind];
    const Block& block = scene.blocks[group.first[kind] + (near ? i : 0) / kBlockLanes];
    const int l = i % kBlockLanes;
    const MotionBox box = box_of(block, l);
    near = near && !apart(box, other);
    const unsigned mask = __ballot_sync(kAllLanes, near);
    if (near) {
      const int slot = count + __popc(mask & lanes_below(lane));
      for (int k = 0; k < 3; ++k) {
        side.lo0[k][slot] = box.lo0[k];
        side.hi0[k][slot] = box.hi0[k];
        side.lo1[k][slot] = box.lo1[k];
        side.hi1[k][slot] = box.hi1[k];
        side.vertex[k][slot] = block.vertex[k][l];
      }
      side.id[slot] = block.id[l];
    }
    count += __popc(mask);
  }
  __syncwarp();
  return count;
}

__device__ inline Vec3<float> scaled_difference(const FloatRecord& a, const FloatRecord& b, int end,
                                                float scale) {
  // Rounded once: as good as the difference in double rounded to float.
  return {scale * (b.x[3 * end] - a.x[3 * end]), scale * (b.x[3 * end + 1] - a.x[3 * end + 1]),
          scale * (b.x[3 * end + 2] - a.x[3 * end + 2])};
}

__device__ inline Vec3<float> scaled_difference(const DoubleRecord& a, const DoubleRecord& b, int end,
                                                float scale) {
  const double s = scale;
  return {static_cast<float>(s * (b.x[3 * end] - a.x[3 * end])),
          static_cast<float>(s * (b.x[3 * end + 1] - a.x[3 * end + 1])),
          static_cast<float>(s * (b.x[3 * end + 2] - a.x[3 * end + 2]))};
}

template <ContactKind kind, class Record>
__device__ inline Differences<float> gather(const SceneView& scene, Candidate c, float scale) {
  const Record* records = static_cast<const Record*>(scene.records);
  Record p[4];
  if constexpr (kind == ContactKind::vertex_face) {
    const std::int32_t* f = scene.mesh.faces[c.b];
    p[0] = records[f[0]];
    p[1] = records[f[1]];
    p[2] = records[f[2]];
    p[3] = records[c.a];
  } else {
    const int2 a = reinterpret_cast<const int2*>(scene.mesh.edges)[c.a];
    const int2 b = reinterpret_cast<const int2*>(scene.mesh.edges)[c.b];
    p[0] = records[a.x];
    p[1] = records[a.y];
    p[2] = records[b.y];
    p[3] = records[b.x];
  }
  Differences<float> d;
  for (int end = 0; end < 2; ++end) {
    d.e1[end] = scaled_difference(p[0], p[1], end, scale);
    d.e2[end] = scaled_difference(kind == ContactKind::vertex_face ? p[0] : p[3], p[2], end, scale);
    d.r[end] = scaled_difference(p[0], p[3], end, scale);
  }
  return d;
}

// What a warp carries through its pairs.
template <class Record>
struct LeafWarp {
  const SceneView& scene;
  LeafScratch& scratch;
  const Output<Survivor> (&survivors)[2];
  float scale;
  int lane;
  int queued[2] = {0, 0};
  std::uint32_t candidates[2] = {0, 0};

  // Filters the last `count` of a queue, at most a warp's worth.
  template <ContactKind kind>
  __device__ void filter(int count) {
    constexpr int k = static_cast<int>(kind);
    queued[k] -= count;
    candidates[k] += count;
    const bool active = lane < count;
    const Candidate c = scratch.queue[k][queued[k] + (active ? lane : 0)];
    __syncwarp();  // the slots are free for the next push
    const Differences<float> d = gather<kind, Record>(scene, c, scale);
    const Magnitudes<float> m = magnitudes(d);
    const Cubic<float> f = coplanarity(d, m);
    bool survives = active && !f.no_root();
    Verdict<float> verdict{};
    if (survives) {
      verdict = decide_at_roots<kind>(d, m, f);
      survives = !verdict.miss;
    }
    const unsigned mask = __ballot_sync(kAllLanes, survives);
    if (mask == 0) return;
    std::uint32_t first = 0;
    if (lane == 0) first = atomicAdd(survivors[k].count, __popc(mask));
    first = __shfl_sync(kAllLanes, first, 0);
    const std::uint32_t slot = first + __popc(mask & lanes_below(lane));
    if (survives && slot < survivors[k].capacity)
      survivors[k].items[slot] = {c, verdict.hit ? verdict.lo : -1.0f, verdict.hi};
  }

  template <ContactKind kind>
  __device__ void push(bool wanted, Candidate c) {
    constexpr int k = static_cast<int>(kind);
    const unsigned mask = __ballot_sync(kAllLanes, wanted);
    if (mask == 0) return;
    if (wanted) scratch.queue[k][queued[k] + __popc(mask & lanes_below(lane))] = c;
    queued[k] += __popc(mask);
    __syncwarp();
    if (queued[k] >= kWarp) filter<kind>(kWarp);
  }

  // All pairs of the two sides; of one side with itself each pair once.
  template <ContactKind kind>
  __device__ void cross(const Side& a, int na, const Side& b, int nb, bool self) {
    const int total = na * nb;
    if (total == 0) return;
    // Division by nb as a product: exact for total <= 48 * 48.
    const unsigned inverse = ((1u << 20) + nb - 1) / nb;
    for (int base = 0; base < total; base += kWarp) {
      const int p = base + lane;
      const int i = static_cast<int>(static_cast<unsigned>(p) * inverse >> 20), j = p - i * nb;
      bool wanted = p < total && (!self || i < j);
      Candidate c{0, 0};
      if (wanted) {
        wanted = !apart(box_of(a, i), box_of(b, j));
        if constexpr (kind == ContactKind::vertex_face) {
          const std::int32_t v = a.id[i];
          wanted = wanted && v != b.vertex[0][j] && v != b.vertex[1][j] && v != b.vertex[2][j];
        } else {
          const std::int32_t v = a.vertex[0][i], w = a.vertex[1][i];
          wanted = wanted && v != b.vertex[0][j] && v != b.vertex[1][j] && w != b.vertex[0][j] &&
                   w != b.vertex[1][j];
        }
        c = {a.id[i], b.id[j]};
      }
      push<kind>(wanted, c);
    }
  }

  __device__ void visit(const Group& a, const MotionBox& box_a, const Group& b, const MotionBox& box_b,
                        bool self, bool vertex_face, bool edge_edge) {
    if (edge_edge) {
      const int na = collect(scene, a, kEdges, box_b, scratch.a, lane);
      if (self) {
        cross<ContactKind::edge_edge>(scratch.a, na, scratch.a, na, true);
      } else if (na > 0) {
        const int nb = collect(scene, b, kEdges, box_a, scratch.b, lane);
        cross<ContactKind::edge_edge>(scratch.a, na, scratch.b, nb, false);
      }
      __syncwarp();
    }
    if (vertex_face) {
      one_way(a, box_a, b, box_b);
      if (!self) one_way(b, box_b, a, box_a);
    }
  }

  // The vertices of one group against the faces of another.
  __device__ void one_way(const Group& a, const MotionBox& box_a, const Group& b,
                          const MotionBox& box_b) {
    const int na = collect(scene, a, kVertices, box_b, scratch.a, lane);
    if (na > 0) {
      const int nb = collect(scene, b, kFaces, box_a, scratch.b, lane);
      cross<ContactKind::vertex_face>(scratch.a, na, scratch.b, nb, false);
    }
    __syncwarp();
  }

  __device__ void finish() {
    if (queued[0] > 0) filter<ContactKind::vertex_face>(queued[0]);
    if (queued[1] > 0) filter<ContactKind::edge_edge>(queued[1]);
  }
};

struct LeafArguments {
  const NodePair* pairs;            // of groups, from the traversal
  const std::uint32_t* pair_count;  // may exceed the capacity: then the step is run again
  std::uint32_t pair_capacity;
  Output<Survivor> survivors[2];
  StepCounters* counters;
  bool vertex_face, edge_edge;
};

template <class Record>
__global__ void __launch_bounds__(kLeafWarps* kWarp)
    leaf_pairs(SceneView scene, LeafArguments arguments) {
  extern __shared__ char shared[];
  LeafScratch& scratch = reinterpret_cast<LeafScratch*>(shared)[threadIdx.x / kWarp];
  const int lane = threadIdx.x % kWarp;
  LeafWarp<Record> warp{scene, scratch, arguments.survivors, static_cast<float>(scene_scale(scene)),
                        lane};
  const std::uint32_t total = min(*arguments.pair_count, arguments.pair_capacity);
  constexpr std::uint32_t batch = 4;
  std::uint32_t opened = 0;
  for (;;) {
    std::uint32_t first = 0;
    if (lane == 0) first = atomicAdd(&arguments.counters->next_leaf_pair, batch);
    first = __shfl_sync(kAllLanes, first, 0);
    if (first >= total) break;
    for (std::uint32_t i = first; i < min(first + batch, total); ++i) {
      const NodePair pair = arguments.pairs[i];
      const MotionBox box_a = scene.boxes[pair.a], box_b = scene.boxes[pair.b];
      if (apart(box_a, box_b)) continue;
      const Group a = scene.groups[pair.a], b = scene.groups[pair.b];
      if ((a.pinned && b.pinned) || !scene.collide(a.body, b.body)) continue;
      ++opened;
      warp.visit(a, box_a, b, box_b, pair.a == pair.b, arguments.vertex_face, arguments.edge_edge);
    }
  }
  warp.finish();
  if (lane == 0) {
    atomicAdd(&arguments.counters->group_pairs, opened);
    atomicAdd(&arguments.counters->candidates[0], warp.candidates[0]);
    atomicAdd(&arguments.counters->candidates[1], warp.candidates[1]);
  }
}

}  // namespace lazyccd::gpu
