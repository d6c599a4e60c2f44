// The kernels for a pair of groups, and the filter, for one instruction set.
#include "host/kernels/leaf_kernels.h"

#include <utility>

#include "core/narrow/roots.h"
#include "core/narrow/separation.h"
#include "cpu/isa/differences.h"
#include "cpu/isa/near.h"
#include "cpu/isa/refit.h"
#include "cpu/isa/within.h"
#include "simd/bits.h"

namespace lazyccd {
namespace LAZYCCD_ISA {
namespace {

constexpr int kPacks = kBlockLanes / FloatLanes::lanes;  // packs in a row of a block
constexpr int kMaxBlocks = 3;  // of one kind in a group: up to 48 edges or vertices

// Returns a lower side that is moved inward by at most `distance`, rounded outward. Both must be
// finite.
LAZYCCD_INLINE float inward(float lower, float distance) {
  if (!(distance > 0)) return lower;
  const float size = lower < 0 ? -lower : lower;
  return lower + distance - 0x1p-22f * (size + distance);
}

// Returns by how much the boxes of two groups may overlap, scaled, though no pair of their
// primitives comes within its separation. Boxes are made for the separation between bodies.
LAZYCCD_INLINE float spare_overlap(const LeafScene& scene, const Group& a, const Group& b) {
  const Separations& separation = scene.separation;
  if (separation.within_body == nullptr || a.body != b.body) return 0;
  // The sides of the boxes may be the largest numbers: they must not be moved then.
  if (!(separation.between_bodies * scene.scale < 0x1p100)) return 0;
  return separation.saving(separation.within(a.self_separation, b.self_separation), scene.scale);
}

// One box, in all lanes, to be tested against blocks. It is smaller by `smaller` on each side.
struct Probe {
  FloatLanes lo0[3], hi0[3], lo1[3], hi1[3];

  LAZYCCD_INLINE Probe(const MotionBox& b, float smaller) {
    for (int k = 0; k < 3; ++k) {
      lo0[k] = FloatLanes(inward(b.lo0[k], smaller));
      hi0[k] = FloatLanes(-inward(-b.hi0[k], smaller));
      lo1[k] = FloatLanes(inward(b.lo1[k], smaller));
      hi1[k] = FloatLanes(-inward(-b.hi1[k], smaller));
    }
  }
  LAZYCCD_INLINE Probe(const Block& b, int lane, float smaller) {
    for (int k = 0; k < 3; ++k) {
      lo0[k] = FloatLanes(inward(b.lo0[k][lane], smaller));
      hi0[k] = FloatLanes(-inward(-b.hi0[k][lane], smaller));
      lo1[k] = FloatLanes(inward(b.lo1[k][lane], smaller));
      hi1[k] = FloatLanes(-inward(-b.hi1[k][lane], smaller));
    }
  }

  // Returns the mask of the lanes of a block that do not certainly stay apart from the box in the
  // linear motion.
  LAZYCCD_INLINE unsigned near(const Block& b) const {
    unsigned bits = 0;
    for (int p = 0; p < kPacks; ++p) {
      const int at = p * FloatLanes::lanes;
      Mask apart =
          (lo0[0] > FloatLanes::load(b.hi0[0] + at)) & (lo1[0] > FloatLanes::load(b.hi1[0] + at));
      apart = apart | ((hi0[0] < FloatLanes::load(b.lo0[0] + at)) &
                       (hi1[0] < FloatLanes::load(b.lo1[0] + at)));
      for (int k = 1; k < 3; ++k) {
        apart = apart | ((lo0[k] > FloatLanes::load(b.hi0[k] + at)) &
                         (lo1[k] > FloatLanes::load(b.hi1[k] + at)));
        apart = apart | ((hi0[k] < FloatLanes::load(b.lo0[k] + at)) &
                         (hi1[k] < FloatLanes::load(b.lo1[k] + at)));
      }
      bits |= (!apart).bits() << at;
    }
    return bits;
  }
};

LAZYCCD_INLINE unsigned equal_lanes(const std::int32_t (&row)[kBlockLanes], std::int32_t x) {
  unsigned bits = 0;
  for (int p = 0; p < kPacks; ++p)
    bits |= equal(row + p * FloatLanes::lanes, x).bits() << (p * FloatLanes::lanes);
  return bits;
}

// Masks of the live lanes of a group's blocks of one kind: lanes that do not stay apart from the
// box of the other group.
struct Live {
  unsigned bits[kMaxBlocks];  // by block
  unsigned any = 0;           // union of all blocks

  LAZYCCD_INLINE Live(const LeafScene& scene, const Group& group, int kind, const Probe& other) {
    const Block* block = scene.blocks + group.first[kind];
    const int blocks = group.blocks(kind);
    for (int i = 0; i < blocks; ++i) any |= bits[i] = other.near(block[i]);
  }
};

// Makes sure that one more row fits into the queue.
LAZYCCD_INLINE void reserve(CandidateSink& sink, ContactKind kind) {
  const CandidateQueue& queue = sink.queues[static_cast<int>(kind)];
  if (queue.count > CandidateQueue::capacity - CandidateQueue::max_per_row) sink.drain(sink, kind);
}

LAZYCCD_INLINE void push(CandidateQueue& queue, std::int32_t a, const std::int32_t* ids,
                         unsigned bits) {
  for (; bits; bits &= bits - 1) queue.items[queue.count++] = {a, ids[lowest_bit(bits)]};
}

LAZYCCD_INLINE void push_in_order(CandidateQueue& queue, std::int32_t a, const std::int32_t* ids,
                                  unsigned bits) {
  for (; bits; bits &= bits - 1) {
    const std::int32_t b = ids[lowest_bit(bits)];
    queue.items[queue.count++] = {a < b ? a : b, a < b ? b : a};
  }
}

// Adds the pairs of live vertices of one group and live faces of another.
LAZYCCD_INLINE void vertices_faces(const LeafScene& scene, const Group& gv, const Live& vertices,
                                   const Group& gf, unsigned faces, float spare,
                                   CandidateSink& sink) {
  if (!vertices.any || !faces) return;
  const Block& face_block = scene.blocks[gf.first[kFaces]];
  CandidateQueue& queue = sink.queues[static_cast<int>(ContactKind::vertex_face)];
  const int blocks = gv.blocks(kVertices);
  for (int i = 0; i < blocks; ++i) {
    const Block& block = scene.blocks[gv.first[kVertices] + i];
    for (unsigned live = vertices.bits[i]; live; live &= live - 1) {
      const int lane = lowest_bit(live);
      const std::int32_t v = block.id[lane];
      unsigned bits = Probe(block, lane, spare).near(face_block) & faces;
      if (!bits) continue;
      for (int k = 0; k < 3; ++k) bits &= ~equal_lanes(face_block.vertex[k], v);
      reserve(sink, ContactKind::vertex_face);
      push(queue, v, face_block.id, bits);
    }
  }
}

// Adds the pairs of live edges of two groups, or of one group with itself. The body of the first
// group must not have the larger index.
LAZYCCD_INLINE void edges_edges(const LeafScene& scene, const Group& ga, const Live& a,
                                const Group& gb, const Live& b, bool self, float spare,
                                CandidateSink& sink) {
  if (!a.any || !b.any) return;
  CandidateQueue& queue = sink.queues[static_cast<int>(ContactKind::edge_edge)];
  const int a_blocks = ga.blocks(kEdges), b_blocks = gb.blocks(kEdges);
  const bool one_body = ga.body == gb.body;
  for (int i = 0; i < a_blocks; ++i) {
    const Block& block = scene.blocks[ga.first[kEdges] + i];
    for (unsigned live = a.bits[i]; live; live &= live - 1) {
      const int lane = lowest_bit(live);
      const Probe probe(block, lane, spare);
      reserve(sink, ContactKind::edge_edge);
      for (int j = self ? i : 0; j < b_blocks; ++j) {
        unsigned wanted = b.bits[j];
        if (self && j == i) wanted &= ~0u << lane << 1;  // each pair once
        if (!wanted) continue;
        const Block& other = scene.blocks[gb.first[kEdges] + j];
        unsigned bits = probe.near(other) & wanted;
        if (!bits) continue;
        for (int k = 0; k < 2; ++k)
          bits &= ~(equal_lanes(other.vertex[k], block.vertex[0][lane]) |
                    equal_lanes(other.vertex[k], block.vertex[1][lane]));
        if (one_body) {
          push_in_order(queue, block.id[lane], other.id, bits);
        } else {
          push(queue, block.id[lane], other.id, bits);
        }
      }
    }
  }
}

bool visit(const LeafScene& scene, std::int32_t a, std::int32_t b, CandidateSink& sink) {
  if (scene.groups[b].body < scene.groups[a].body) std::swap(a, b);
  const Group &ga = scene.groups[a], &gb = scene.groups[b];
  const bool self = a == b;
  const float spare = spare_overlap(scene, ga, gb);
  const MotionBox &box_a = scene.boxes[a], &box_b = scene.boxes[b];
  for (int k = 0; k < 3; ++k) {
    if ((box_a.lo0[k] > box_b.hi0[k] && box_a.lo1[k] > box_b.hi1[k]) ||
        (box_a.hi0[k] < box_b.lo0[k] && box_a.hi1[k] < box_b.lo1[k]))
      return false;
  }
  const Probe near_a(box_a, spare), near_b(box_b, spare);
  if (scene.vertex_face) {
    const Live va(scene, ga, kVertices, near_b), fb(scene, gb, kFaces, near_a);
    if (gb.count[kFaces]) vertices_faces(scene, ga, va, gb, fb.bits[0], spare, sink);
    if (!self && ga.count[kFaces]) {
      const Live vb(scene, gb, kVertices, near_a), fa(scene, ga, kFaces, near_b);
      vertices_faces(scene, gb, vb, ga, fa.bits[0], spare, sink);
    }
  }
  if (scene.edge_edge) {
    const Live ea(scene, ga, kEdges, near_b), eb(scene, gb, kEdges, near_a);
    edges_edges(scene, ga, ea, gb, eb, self, spare, sink);
  }
  return true;
}

template <ContactKind kind>
int filter_kind(const LeafScene& scene, const Candidate* candidates, int count,
                Survivor* survivors) {
  int found = 0;
  for (int begin = 0; begin < count; begin += FloatLanes::lanes) {
    Candidate padded[FloatLanes::lanes];
    const int used = count - begin < FloatLanes::lanes ? count - begin : FloatLanes::lanes;
    for (int i = 0; i < FloatLanes::lanes; ++i) padded[i] = candidates[begin + (i < used ? i : 0)];
    const unsigned wanted = (1u << used) - 1;

    const Differences<FloatLanes> d = gather<kind>(scene, padded);
    const Magnitudes<FloatLanes> m = magnitudes(d);
    const Cubic<FloatLanes> f = coplanarity(d, m);
    if (scene.filtered_noncoplanar) {
      const unsigned left = (!f.no_root()).bits() & wanted;
      *scene.filtered_noncoplanar += used - count_bits(left);
      if (!left) continue;
    }
    const Verdict<FloatLanes> verdict = decide_at_roots<kind>(d, m, f);
    alignas(64) float lo[FloatLanes::lanes], hi[FloatLanes::lanes];
    verdict.lo.store(lo);
    verdict.hi.store(hi);
    const unsigned hits = verdict.hit.bits();
    for (unsigned left = (!verdict.miss).bits() & wanted; left; left &= left - 1) {
      const int i = lowest_bit(left);
      survivors[found++] = {padded[i], lo[i], hi[i], (hits >> i & 1) != 0};
    }
  }
  return found;
}

int filter(const LeafScene& scene, ContactKind kind, const Candidate* candidates, int count,
           Survivor* survivors) {
  return kind == ContactKind::vertex_face
             ? filter_kind<ContactKind::vertex_face>(scene, candidates, count, survivors)
             : filter_kind<ContactKind::edge_edge>(scene, candidates, count, survivors);
}

#define LAZYCCD_TEXT(x) #x
#define LAZYCCD_NAME(x) LAZYCCD_TEXT(x)

}  // namespace

extern const LeafKernels kernels;
const LeafKernels kernels{LAZYCCD_NAME(LAZYCCD_ISA),
                          box_vertices,
                          box_groups,
                          visit,
                          filter,
                          near_at_start,
                          within,
                          describe};

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
