// The leaf kernel: a warp a pair of groups. It lists the primitives of each that come near the other,
// tests the listed ones pairwise, and filters what may touch, 32 candidates at a time, without ever
// writing a candidate to memory.
#pragma once

#include "core/elementary.h"
#include "core/node_pair.h"
#include "gpu/refit.cuh"

namespace lazyccd::gpu {

constexpr int kMaxPrimitives = 2 * 48 + kGroupCells;  // vertices, edges and faces of a group
constexpr int kLeafWarps = 4;                         // a block

// A warp's shared memory.
struct LeafScratch {
  Candidate queue[2][2 * kWarp];       // by ContactKind; less than a warp's worth between pushes
  std::uint8_t listed[2][kMaxPrimitives];  // of group a and b: primitives that come near the other
};

// Three 16-byte loads, all under way before the first use.
__device__ inline MotionBox load(const PrimitiveBox* from) {
  union {
    float4 quads[3];
    MotionBox box;
  } value;
  for (int i = 0; i < 3; ++i) value.quads[i] = reinterpret_cast<const float4*>(from)[i];
  return value.box;
}

__device__ inline PrimitiveNames load(const PrimitiveNames* from) {
  const int4 names = *reinterpret_cast<const int4*>(from);
  return {names.x, {names.y, names.z, names.w}};
}

// Certainly apart in the linear motion: on the same side at both ends. Without branches: a lane that
// could leave early waits for the others anyway.
__device__ inline bool apart(const float* lo0_a, const float* hi0_a, const float* lo1_a,
                             const float* hi1_a, const float* lo0_b, const float* hi0_b,
                             const float* lo1_b, const float* hi1_b, int axes) {
  bool result = false;
  for (int k = 0; k < axes; ++k)
    result |= ((lo0_a[k] > hi0_b[k]) & (lo1_a[k] > hi1_b[k])) |
              ((hi0_a[k] < lo0_b[k]) & (hi1_a[k] < lo1_b[k]));
  return result;
}
__device__ inline bool apart(const MotionBox& a, const MotionBox& b) {
  return apart(a.lo0, a.hi0, a.lo1, a.hi1, b.lo0, b.hi0, b.lo1, b.hi1, 3);
}
__device__ inline bool apart(const DiagonalSlabs& a, const DiagonalSlabs& b) {
  return apart(a.lo0, a.hi0, a.lo1, a.hi1, b.lo0, b.hi0, b.lo1, b.hi1, kDiagonals);
}

__device__ inline unsigned lanes_below(int lane) { return (1u << lane) - 1; }

// How many primitives of each kind are listed; they lie in that order.
struct Listed {
  int count[3];
  __device__ int first(int kind) const {
    return kind == kVertices ? 0 : kind == kEdges ? count[0] : count[0] + count[1];
  }
};

__device__ inline Listed list_near(const SceneView& scene, const DeviceGroup& group,
                                   const MotionBox& other, std::uint8_t* list, int lane) {
  Listed listed{{0, 0, 0}};
  const int total = group.total();
  for (int base = 0; base < total; base += kWarp) {
    const int i = base + lane;
    const bool near = !apart(load(scene.primitives + group.first + min(i, total - 1)), other) && i < total;
    const unsigned mask = __ballot_sync(kAllLanes, near);
    if (mask == 0) continue;
    const int before = listed.count[0] + listed.count[1] + listed.count[2];
    if (near) list[before + __popc(mask & lanes_below(lane))] = static_cast<std::uint8_t>(i);
    const unsigned up_to_vertices = __ballot_sync(kAllLanes, near && i < group.count[0]);
    const unsigned up_to_edges =
        __ballot_sync(kAllLanes, near && i < group.count[0] + group.count[1]);
    listed.count[0] += __popc(up_to_vertices);
    listed.count[1] += __popc(up_to_edges & ~up_to_vertices);
    listed.count[2] += __popc(mask & ~up_to_edges);
  }
  __syncwarp();
  return listed;
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

__device__ inline FloatRecord load(const FloatRecord* from) {
  union {
    float4 quads[2];
    FloatRecord record;
  } value;
  for (int i = 0; i < 2; ++i) value.quads[i] = reinterpret_cast<const float4*>(from)[i];
  return value.record;
}
__device__ inline DoubleRecord load(const DoubleRecord* from) {
  union {
    double2 pairs[3];
    DoubleRecord record;
  } value;
  for (int i = 0; i < 3; ++i) value.pairs[i] = reinterpret_cast<const double2*>(from)[i];
  return value.record;
}

template <ContactKind kind, class Record>
__device__ inline Differences<float> gather(const SceneView& scene, Candidate c, float scale) {
  const Record* records = static_cast<const Record*>(scene.records);
  Record p[4];
  if constexpr (kind == ContactKind::vertex_face) {
    const std::int32_t* f = scene.mesh.faces[c.b];
    p[0] = load(records + f[0]);
    p[1] = load(records + f[1]);
    p[2] = load(records + f[2]);
    p[3] = load(records + c.a);
  } else {
    const int2 a = reinterpret_cast<const int2*>(scene.mesh.edges)[c.a];
    const int2 b = reinterpret_cast<const int2*>(scene.mesh.edges)[c.b];
    p[0] = load(records + a.x);
    p[1] = load(records + a.y);
    p[2] = load(records + b.y);
    p[3] = load(records + b.x);
  }
  Differences<float> d;
  for (int end = 0; end < 2; ++end) {
    d.e1[end] = scaled_difference(p[0], p[1], end, scale);
    d.e2[end] = scaled_difference(kind == ContactKind::vertex_face ? p[0] : p[3], p[2], end, scale);
    d.r[end] = scaled_difference(p[0], p[3], end, scale);
  }
  return d;
}

// Reserves room in an output for the lanes that want it: one atomic a warp. All lanes call.
template <class T>
__device__ inline void append_lanes(const Output<T>& output, bool wanted, const T& item, int lane) {
  const unsigned mask = __ballot_sync(kAllLanes, wanted);
  if (mask == 0) return;
  std::uint32_t first = 0;
  if (lane == 0) first = atomicAdd(output.count, __popc(mask));
  first = __shfl_sync(kAllLanes, first, 0);
  const std::uint32_t slot = first + __popc(mask & lanes_below(lane));
  if (wanted && slot < output.capacity) output.items[slot] = item;
}

// What a warp carries through its pairs.
template <class Record>
struct LeafWarp {
  const SceneView& scene;
  LeafScratch& scratch;
  const Output<Candidate> (&filtered)[2];
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
    const bool survives = active && !coplanarity(d, magnitudes(d)).no_root();
    append_lanes(filtered[k], survives, c, lane);
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

  // Division of up to 48 * 48 by n <= 48 as a product: the inverse is between 2^20 / n and 3 more, so
  // the quotient is too large by less than 48 * 48 * 3 / 2^20 < 1 / 48.
  __device__ static unsigned inverse(int n) {
    return static_cast<unsigned>(__fdividef(1048576.0f, static_cast<float>(max(n, 1)))) + 2;
  }
  __device__ static int divided(int p, unsigned inverse_of_n) {
    return static_cast<int>(static_cast<unsigned>(p) * inverse_of_n >> 20);
  }

  // All pairs of listed edges; of one group with itself each pair once.
  __device__ void edges_edges(const DeviceGroup& a, const Listed& la, const DeviceGroup& b,
                              const Listed& lb, bool self) {
    const int nb = lb.count[kEdges], total = la.count[kEdges] * nb;
    if (total == 0) return;
    const std::uint8_t* list_a = scratch.listed[0] + la.first(kEdges);
    const std::uint8_t* list_b = scratch.listed[self ? 0 : 1] + lb.first(kEdges);
    const unsigned inverse_nb = inverse(nb);
    for (int base = 0; base < total; base += kWarp) {
      const int p = base + lane, i = divided(p, inverse_nb), j = p - i * nb;
      bool wanted = p < total && (!self || i < j);
      Candidate c{0, 0};
      if (wanted) {
        const int slot_a = a.first + list_a[i], slot_b = b.first + list_b[j];
        wanted = !apart(load(scene.primitives + slot_a), load(scene.primitives + slot_b));
        if (wanted) {
          const PrimitiveNames x = load(scene.names + slot_a), y = load(scene.names + slot_b);
          wanted = (x.vertex[0] != y.vertex[0]) & (x.vertex[0] != y.vertex[1]) &
                   (x.vertex[1] != y.vertex[0]) & (x.vertex[1] != y.vertex[1]);
          c = {x.id, y.id};
        }
      }
      push<ContactKind::edge_edge>(wanted, c);
    }
  }

  // The listed vertices of each group against the listed faces of the other, both ways in one loop.
  __device__ void vertices_faces(const DeviceGroup& a, const Listed& la, const DeviceGroup& b,
                                 const Listed& lb, bool self) {
    const int faces_b = lb.count[kFaces], faces_a = la.count[kFaces];
    const int forth = la.count[kVertices] * faces_b;
    const int total = forth + (self ? 0 : lb.count[kVertices] * faces_a);
    if (total == 0) return;
    const std::uint8_t *list_a = scratch.listed[0], *list_b = scratch.listed[self ? 0 : 1];
    const unsigned inverse_b = inverse(faces_b), inverse_a = inverse(faces_a);
    for (int base = 0; base < total; base += kWarp) {
      const bool back = base + lane >= forth;
      const int p = base + lane - (back ? forth : 0);
      const int i = divided(p, back ? inverse_a : inverse_b), j = p - i * (back ? faces_a : faces_b);
      bool wanted = base + lane < total;
      Candidate c{0, 0};
      if (wanted) {
        const int vertex = back ? b.first + list_b[i] : a.first + list_a[i];
        const int face = back ? a.first + list_a[la.first(kFaces) + j]
                              : b.first + list_b[lb.first(kFaces) + j];
        wanted = !apart(load(scene.primitives + vertex), load(scene.primitives + face));
        if (wanted) {
          const std::int32_t v = scene.names[vertex].id;
          const PrimitiveNames f = load(scene.names + face);
          wanted = (v != f.vertex[0]) & (v != f.vertex[1]) & (v != f.vertex[2]);
          c = {v, f.id};
        }
      }
      push<ContactKind::vertex_face>(wanted, c);
    }
  }

  // Whether a pair of groups is to be visited; each lane asks for a pair of its own.
  __device__ bool opens(NodePair pair) const {
    if (apart(load(scene.boxes + pair.a), load(scene.boxes + pair.b)) ||
        apart(scene.slabs[pair.a], scene.slabs[pair.b]))
      return false;
    const DeviceGroup &a = scene.groups[pair.a], &b = scene.groups[pair.b];
    return !(a.pinned && b.pinned) && scene.collide(a.body, b.body);
  }

  __device__ void visit(NodePair pair, bool vertex_face, bool edge_edge) {
    const bool self = pair.a == pair.b;
    const DeviceGroup a = scene.groups[pair.a], b = scene.groups[pair.b];
    const MotionBox box_a = load(scene.boxes + pair.a), box_b = load(scene.boxes + pair.b);
    const Listed la = list_near(scene, a, box_b, scratch.listed[0], lane);
    if (la.count[0] + la.count[1] + la.count[2] > 0) {
      const Listed lb = self ? la : list_near(scene, b, box_a, scratch.listed[1], lane);
      if (edge_edge) edges_edges(a, la, b, lb, self);
      if (vertex_face) vertices_faces(a, la, b, lb, self);
    }
    __syncwarp();  // the lists are free for the next pair
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
  Output<Candidate> filtered[2];    // by ContactKind
  StepCounters* counters;
  bool vertex_face, edge_edge;
};

template <class Record>
__global__ void __launch_bounds__(kLeafWarps* kWarp, 8)
    leaf_pairs(SceneView scene, LeafArguments arguments) {
  __shared__ LeafScratch scratch[kLeafWarps];
  const std::uint32_t lane = threadIdx.x % kWarp;
  LeafWarp<Record> warp{scene, scratch[threadIdx.x / kWarp], arguments.filtered,
                        static_cast<float>(scene_scale(scene)),
                        static_cast<int>(lane)};
  const std::uint32_t total = min(*arguments.pair_count, arguments.pair_capacity);
  // A lane a pair to find those to open, then the warp together for each. Few at a time: heavy pairs lie
  // side by side.
  const std::uint32_t warps = gridDim.x * kLeafWarps;
  const std::uint32_t batch = min(max(total / (8 * warps), 1u), 4u);
  std::uint32_t opened = 0;
  for (;;) {
    std::uint32_t first = 0;
    if (lane == 0) first = atomicAdd(&arguments.counters->next_leaf_pair, batch);
    first = __shfl_sync(kAllLanes, first, 0);
    if (first >= total) break;
    NodePair mine{0, 0};
    bool open = lane < batch && first + lane < total;
    if (open) {
      mine = arguments.pairs[first + lane];
      open = warp.opens(mine);
    }
    unsigned left = __ballot_sync(kAllLanes, open);
    opened += __popc(left);
    for (; left; left &= left - 1) {
      const int from = __ffs(left) - 1;
      const NodePair pair{__shfl_sync(kAllLanes, mine.a, from), __shfl_sync(kAllLanes, mine.b, from)};
      warp.visit(pair, arguments.vertex_face, arguments.edge_edge);
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
