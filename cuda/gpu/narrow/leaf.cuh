// The leaf kernel: one warp per pair of groups. It lists the primitives of each group that come
// near the other group, and tests the listed primitives pairwise. It filters the pairs that may
// touch, 32 candidates at a time, and never writes an unfiltered candidate to memory.
#pragma once

#include <type_traits>

#include "core/bvh/node_pair.h"
#include "core/narrow/separation.h"
#include "gpu/narrow/query.cuh"
#include "gpu/scene/stages.h"

namespace lazyccd::gpu {

constexpr int kMaxPrimitives = 2 * 48 + kGroupCells;  // vertices, edges and faces of a group
constexpr int kLeafWarps = 4;                         // per block
// Blocks per multiprocessor: 72 registers per thread, 80 in double precision.
template <class Record>
constexpr int kLeafBlocks = std::is_same_v<Record, FloatRecord> ? 7 : 6;

/// Shared memory of one warp.
struct LeafScratch {
  // Places of candidates, by ContactKind. Between pushes a queue holds less than a warp's worth.
  Candidate queue[2][2 * kWarp];
  std::int32_t listed[2][kMaxPrimitives];  // groups a, b: places of primitives near the other group
  int2 edge_vertices[2][48];               // of the listed edges
  // Of the listed primitives of group b: their boxes in the frame of group a, flipped.
  uint4 boxes_xy[kMaxPrimitives];
  uint2 boxes_z[kMaxPrimitives];

  __device__ BoxArrays boxes() { return {boxes_xy, boxes_z}; }
};

__device__ inline PrimitiveNames names_at(const GroupView& view, int place) {
  return load_wide(view.names + place);
}

/// The listed primitives of one group of a pair: their places, sorted by kind.
struct LeafSide {
  std::int32_t* listed;
  int2* edge_vertices;
  int count[3] = {0, 0, 0};

  __device__ LeafSide(LeafScratch& scratch, int side)
      : listed(scratch.listed[side]), edge_vertices(scratch.edge_vertices[side]) {}
  /// Returns the index of the first listed primitive of one kind. There are count[kind] of them.
  __device__ int first(int kind) const {
    return (kind > kVertices ? count[kVertices] : 0) + (kind > kEdges ? count[kEdges] : 0);
  }
  __device__ int total() const { return count[kVertices] + count[kEdges] + count[kFaces]; }

  /// Lists the primitives that come near a group with these bounds.
  __device__ void list_near(const GroupView& view, const DeviceGroup& group,
                            const GroupFrame& frame, const GroupBounds& bounds, int lane) {
    const HalfBox other = HalfBox::flipped_in_frame(bounds.axis, frame, lane);
    const int vertices = group.count[kVertices], edges = vertices + group.count[kEdges];
    const int total = edges + group.count[kFaces];
    int before = 0;
    // Two rounds at a time, so that their loads overlap. The last round may read beyond the group.
    static_assert(2 * kWarp <= kReadBeyond);
    for (int base = 0; base < total; base += 2 * kWarp) {
      const int i[2] = {base + lane, base + kWarp + lane};
      const HalfBox boxes[2] = {view.boxes.load(group.first_place + i[0]),
                                view.boxes.load(group.first_place + i[1])};
      for (int round = 0; round < 2; ++round) {
        const bool near = !boxes[round].apart(other) && i[round] < total;
        const unsigned mask = __ballot_sync(kAllLanes, near);
        const int slot = before + __popc(mask & lanes_below(lane));
        before += __popc(mask);
        count[kVertices] += __popc(__ballot_sync(kAllLanes, near && i[round] < vertices));
        count[kFaces] += __popc(__ballot_sync(kAllLanes, near && i[round] >= edges));
        if (near) {
          const int place = group.first_place + i[round];
          listed[slot] = place;
          if (i[round] >= vertices && i[round] < edges) {
            const PrimitiveNames names = names_at(view, place);
            edge_vertices[slot - count[kVertices]] = {names.vertex[0], names.vertex[1]};
          }
        }
      }
    }
    count[kEdges] = before - count[kVertices] - count[kFaces];
    __syncwarp();
  }
};

__device__ inline void swap(LeafSide& a, LeafSide& b) {
  const LeafSide other = a;
  a = b;
  b = other;
}

/// How the leaf kernel filters candidates: with the non-penetration filter or without.
template <bool is_on>
struct LeafFilter {
  static constexpr bool non_penetration = is_on;
  static constexpr bool drops_any = false;  // otherwise it has drops(kind, candidate)
};

/// State of a warp, kept over all its pairs. has_separation: there is a minimum separation. Filter:
/// LeafFilter, or a class with the same members.
template <class Record, bool has_separation, class Filter>
struct LeafWarp {
  const SceneView& scene;
  const Filter& culling;
  LeafScratch& scratch;
  const Output<Candidate> (&filtered)[2];
  float scale;
  float separation;  // times scale, rounded up
  int lane;
  int queued[2] = {0, 0};
  std::uint32_t candidates[2] = {0, 0};

  /// Filters the last `count` candidates of a queue, at most a warp's worth.
  template <ContactKind kind>
  __device__ void filter(int count) {
    constexpr int k = static_cast<int>(kind);
    queued[k] -= count;
    candidates[k] += count;
    bool active = lane < count;
    const Candidate places = scratch.queue[k][queued[k] + (active ? lane : 0)];
    __syncwarp();  // the slots are free for the next push
    const PrimitiveNames a = names_at(scene.groups, places.a), b = names_at(scene.groups, places.b);
    const Candidate c{a.id, b.id};
    if constexpr (Filter::drops_any) {
      const bool dropped = active && culling.drops(kind, c);
      candidates[k] -= __popc(__ballot_sync(kAllLanes, dropped));
      active = active && !dropped;
    }
    const Differences<float> d =
        kind == ContactKind::vertex_face
            ? gather_points<kind, Record>(scene, b.vertex[0], b.vertex[1], b.vertex[2], a.id, scale)
            : gather_points<kind, Record>(scene, a.vertex[0], a.vertex[1], b.vertex[1], b.vertex[0],
                                          scale);
    const Magnitudes<float> m = magnitudes(d);
    const bool apart =
        has_separation ? planes_apart(d, m, separation) : coplanarity(d, m).no_root();
    const bool survives = active && !(apart && culling.non_penetration);
    append_lanes(filtered[k], survives, c, lane);
  }

  /// Queues the candidates of the lanes that want it. Filters them once there is a warp's worth.
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

  /// Returns a factor that replaces a division by n <= 48, for numerators up to 48 * 48. It is
  /// between 2^20 / n and 3 more. So the quotient is too large by less than 48 * 48 * 3 / 2^20 < 1
  /// / 48.
  __device__ static unsigned inverse(int n) {
    unsigned inverse =
        static_cast<unsigned>(__fdividef(1048576.0f, static_cast<float>(max(n, 1)))) + 2;
    asm volatile("" : "+r"(inverse));  // computed once, not in every round of a loop
    return inverse;
  }
  __device__ static int divided(int p, unsigned inverse_of_n) {
    return static_cast<int>(static_cast<unsigned>(p) * inverse_of_n >> 20);
  }

  /// Tests all pairs of listed edges. A group with itself: each pair once. The n edges lie on a
  /// circle, and each is tested against the next ones, up to half way round.
  __device__ void edges_edges(const LeafSide& a, const LeafSide& b, bool self) {
    const int na = a.count[kEdges], nb = b.count[kEdges];
    const int total = self ? na * (na - 1) / 2 : na * nb;
    const int first_a = a.first(kEdges), first_b = b.first(kEdges);
    const unsigned inverse_nb = inverse(nb);
    for (int base = 0; base < total; base += kWarp) {
      const int p = min(base + lane, total - 1), row = divided(p, inverse_nb),
                column = p - row * nb;
      const int beyond = column + row + 1;
      const int i = self ? column : row, j = !self ? column : beyond < nb ? beyond : beyond - nb;
      const int place_a = a.listed[first_a + i], place_b = b.listed[first_b + j];
      const int2 x = a.edge_vertices[i], y = b.edge_vertices[j];
      const bool disjoint = (x.x != y.x) & (x.x != y.y) & (x.y != y.x) & (x.y != y.y);
      const bool wanted =
          !scene.groups.boxes.load(place_a).apart(scratch.boxes().load(first_b + j)) && disjoint &&
          base + lane < total;
      const Candidate c{place_a, place_b};
      push<ContactKind::edge_edge>(wanted, c);
    }
  }

  /// Tests the listed vertices of one group against the listed faces of another. kept: the boxes of
  /// the faces are in the frame of the other group; otherwise those of the vertices are.
  __device__ void vertices_faces(const LeafSide& a, const LeafSide& b, bool faces_kept) {
    const int faces = b.count[kFaces], total = a.count[kVertices] * faces;
    const int first_a = a.first(kVertices), first_b = b.first(kFaces);
    const unsigned inverse_faces = inverse(faces);
    for (int base = 0; base < total; base += kWarp) {
      const int p = min(base + lane, total - 1), row = divided(p, inverse_faces);
      const int slot_a = first_a + row, slot_b = first_b + p - row * faces;
      const int place_a = a.listed[slot_a], place_b = b.listed[slot_b];
      const HalfBox other = scratch.boxes().load(faces_kept ? slot_b : slot_a);
      bool wanted = !scene.groups.boxes.load(faces_kept ? place_a : place_b).apart(other) &&
                    base + lane < total;
      if (wanted) {
        const std::int32_t v = names_at(scene.groups, place_a).id;
        const PrimitiveNames f = names_at(scene.groups, place_b);
        wanted = (v != f.vertex[0]) & (v != f.vertex[1]) & (v != f.vertex[2]);
      }
      const Candidate c{place_a, place_b};
      push<ContactKind::vertex_face>(wanted, c);
    }
  }
  /// Lists and tests the primitives of one pair of groups.
  __device__ void visit(NodePair pair, bool vertex_face, bool edge_edge) {
    const bool self = pair.a == pair.b;
    const GroupView& view = scene.groups;
    const DeviceGroup group_a = load_wide(view.groups + pair.a),
                      group_b = load_wide(view.groups + pair.b);
    LeafSide a(scratch, 0), b(scratch, 1);
    const GroupBounds &bounds_a = view.bounds[pair.a], &bounds_b = view.bounds[pair.b];
    const GroupFrame frame_a = load_wide(&bounds_a.frame);
    a.list_near(view, group_a, frame_a, bounds_b, lane);
    if (a.total() != 0) {
      const GroupFrame frame_b = load_wide(&bounds_b.frame);
      b.list_near(view, group_b, frame_b, bounds_a, lane);
      const FrameChange to_a(frame_b, frame_a);
      for (int slot = lane; slot < b.total(); slot += kWarp)
        scratch.boxes().store(slot, to_a.flipped(view.boxes.load(b.listed[slot])));
      __syncwarp();
      if (edge_edge) edges_edges(a, b, self);
      for (int way = 0; vertex_face && way < (self ? 1 : 2); ++way) {
        vertices_faces(a, b, way == 0);
        swap(a, b);
      }
    }
    __syncwarp();  // the lists are free for the next pair
  }

  /// Filters the candidates that are still queued.
  __device__ void finish() {
    if (queued[0] > 0) filter<ContactKind::vertex_face>(queued[0]);
    if (queued[1] > 0) filter<ContactKind::edge_edge>(queued[1]);
  }
};

/// The leaf kernel. has_separation, Filter: see LeafWarp.
template <class Record, bool has_separation, class Filter>
__global__ void __launch_bounds__(kLeafWarps* kWarp, kLeafBlocks<Record>)
    leaf_pairs(SceneView scene, LeafPairs pairs, bool vertex_face, bool edge_edge, StepLists lists,
               Filter culling) {
  begin_kernel();
  __shared__ LeafScratch scratch[kLeafWarps];
  const int lane = threadIdx.x % kWarp;
  const double scale = scene_scale(scene);
  LeafWarp<Record, has_separation, Filter> warp{
      scene,
      culling,
      scratch[threadIdx.x / kWarp],
      lists.filtered,
      static_cast<float>(scale),
      has_separation ? __double2float_ru(scene.separation.between_bodies * scale) : 0,
      lane};
  const std::uint32_t end = min(*pairs.count, pairs.last);
  const std::uint32_t total = end > pairs.first ? end - pairs.first : 0;
  const NodePair* const items = pairs.pairs + pairs.first;
  // A warp takes few pairs at a time, because expensive pairs lie side by side. Its first batch is
  // fixed; it claims each further batch before it needs it.
  const std::uint32_t warps = gridDim.x * kLeafWarps;
  const std::uint32_t batch = min(max(total / (8 * warps), 1u), 4u);
  for (std::uint32_t first = (blockIdx.x * kLeafWarps + threadIdx.x / kWarp) * batch;
       first < total;) {
    std::uint32_t claimed = 0;
    if (lane == 0) claimed = atomicAdd(&lists.counters->next_leaf_pair, batch);
    const std::uint32_t last = min(first + batch, total);
    for (std::uint32_t k = first; k < last; ++k) warp.visit(items[k], vertex_face, edge_edge);
    first = warps * batch + __shfl_sync(kAllLanes, claimed, 0);
  }
  warp.finish();
  if (lane == 0) {
    for (int kind = 0; kind < 2; ++kind)
      if (warp.candidates[kind]) add_to(lists.counters->candidates[kind], warp.candidates[kind]);
  }
}

/// Enqueues the leaf kernel with a filter.
template <class Filter>
void enqueue_leaf_kernel(const SceneView& scene, const LeafPairs& pairs, bool vertex_face,
                         bool edge_edge, const Filter& filter, const StepLists& lists,
                         cudaStream_t stream) {
  const bool has_separation = scene.separation.between_bodies > 0;
  const auto chosen = scene.is_double ? (has_separation ? leaf_pairs<DoubleRecord, true, Filter>
                                                        : leaf_pairs<DoubleRecord, false, Filter>)
                                      : (has_separation ? leaf_pairs<FloatRecord, true, Filter>
                                                        : leaf_pairs<FloatRecord, false, Filter>);
  const int blocks = scene.is_double ? kLeafBlocks<DoubleRecord> : kLeafBlocks<FloatRecord>;
  launch_behind(chosen, static_cast<std::uint32_t>(blocks) * multiprocessors(), kLeafWarps * kWarp,
                0, stream, scene, pairs, vertex_face, edge_edge, lists, filter);
}

}  // namespace lazyccd::gpu
