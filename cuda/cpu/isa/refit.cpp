#include "cpu/isa/refit.h"

#include "cpu/isa/records.h"
#include "cpu/isa/transpose.h"

namespace lazyccd {
namespace LAZYCCD_ISA {
namespace {

typedef std::int32_t Int8 __attribute__((vector_size(32), aligned(32)));
typedef std::uint32_t UInt8 __attribute__((vector_size(32), aligned(32)));

// Beyond the range of float its largest number stands in: no two sides change their order, and only
// those of unused lanes are infinite.
constexpr float kLargest = 0x1.fffffep127f;

// Between the bits of floats and their order, which differs by the sign.
LAZYCCD_INLINE Int8 ordered(Int8 bits) {
  return bits < 0 ? reinterpret_cast<Int8>(0x80000000u - reinterpret_cast<UInt8>(bits)) : bits;
}

// The float below where `below` is -1, the one two below where it is -2, and so on.
LAZYCCD_INLINE Float8 stepped_down(Float8 x, Int8 below) {
  const Float8 lower =
      reinterpret_cast<Float8>(ordered(ordered(reinterpret_cast<Int8>(x)) + below));
  return lower < -kLargest ? Float8{} - kLargest : lower;
}

// At most x; where `outwards` is -1, the number below that.
LAZYCCD_INLINE Float8 rounded_down(Double8 x, int outwards) {
  const Double8 most = Double8{} + static_cast<double>(kLargest);
  x = x > most ? most : x;
  x = x < -most ? -most : x;
  const Float8 nearest = __builtin_convertvector(x, Float8);
  const Int8 above = __builtin_convertvector(__builtin_convertvector(nearest, Double8) > x, Int8);
  return stepped_down(nearest, above + outwards);
}

LAZYCCD_INLINE void widen(VertexBox& box, const VertexBox& by) {
  for (int i = 0; i < 16; ++i) box.side[i] = box.side[i] > by.side[i] ? box.side[i] : by.side[i];
}

LAZYCCD_INLINE VertexBox empty_box() {
  VertexBox box;
  for (float& side : box.side) side = -__builtin_inff();
  return box;
}

}  // namespace

void box_vertices(const double* records, double scale, double margin, std::size_t first,
                  std::size_t last, VertexBox* boxes) {
  const Double8* x = reinterpret_cast<const Double8*>(records);
  // One number of float further out makes up for the rounding of x - margin in double.
  const int outwards = margin > 0 ? -1 : 0;
  for (std::size_t v = first; v < last; ++v) {
    Float8* sides = reinterpret_cast<Float8*>(boxes[v].side);
    const Double8 scaled = x[v] * scale;
    sides[0] = -rounded_down(scaled - margin, outwards);
    sides[1] = -rounded_down(-scaled - margin, outwards);
  }
}

void box_groups(const VertexBox* vertices, const Group* groups, std::size_t first, std::size_t last,
                Block* blocks, MotionBox* boxes) {
  for (std::size_t g = first; g < last; ++g) {
    VertexBox all = empty_box();
    for (int kind = 0; kind < 3; ++kind) {
      const int lanes = groups[g].blocks(kind) * kBlockLanes;
      for (int lane = 0; lane < lanes; ++lane) {
        Block& b = blocks[groups[g].first[kind] + lane / kBlockLanes];
        const int l = lane % kBlockLanes;
        VertexBox box = empty_box();
        for (int k = 0; k <= kind && b.vertex[k][l] >= 0; ++k) widen(box, vertices[b.vertex[k][l]]);
        widen(all, box);
        for (int k = 0; k < 3; ++k) {
          b.lo0[k][l] = -box.lower(0)[k];
          b.hi0[k][l] = box.upper(0)[k];
          b.lo1[k][l] = -box.lower(1)[k];
          b.hi1[k][l] = box.upper(1)[k];
        }
      }
    }
    for (int k = 0; k < 3; ++k) {
      boxes[g].lo0[k] = -all.lower(0)[k];
      boxes[g].hi0[k] = all.upper(0)[k];
      boxes[g].lo1[k] = -all.lower(1)[k];
      boxes[g].hi1[k] = all.upper(1)[k];
    }
  }
}

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
