#include "cpu/isa/refit.h"

#include "cpu/isa/records.h"
#include "cpu/isa/transpose.h"

namespace lazyccd {
namespace LAZYCCD_ISA {
namespace {

using Int8 = SimdVector<std::int32_t, 8>;
using UInt8 = SimdVector<std::uint32_t, 8>;

// Numbers beyond the range of float are replaced by its largest number. So no two sides change
// their order, and only the sides of unused lanes are infinite.
constexpr float kLargest = 0x1.fffffep127f;

// Converts between the bits of floats and integers in the same order. They differ for negative
// floats.
LAZYCCD_INLINE Int8 ordered(Int8 bits) {
  return choose(bits < 0, bit_cast<Int8>(0x80000000u - bit_cast<UInt8>(bits)), bits);
}

// Returns the float -steps places below x: the next lower float for -1, the second lower for -2.
LAZYCCD_INLINE Float8 stepped_down(Float8 x, Int8 steps) {
  const Float8 lower = bit_cast<Float8>(ordered(ordered(bit_cast<Int8>(x)) + steps));
  const Float8 lowest = Float8{} - kLargest;
  return choose(lower < lowest, lowest, lower);
}

// Returns the largest float that is at most x. If `outwards` is -1, returns the float below that
// one.
LAZYCCD_INLINE Float8 rounded_down(Double8 x, int outwards) {
  const Double8 largest = Double8{} + static_cast<double>(kLargest);
  x = choose(x > largest, largest, x);
  x = choose(x < -largest, -largest, x);
  const Float8 nearest = convert<Float8>(x);
  const Int8 above = convert<Int8>(convert<Double8>(nearest) > x);
  return stepped_down(nearest, above + outwards);
}

// The two halves of a VertexBox: the negated lower sides, and the upper sides.
struct Sides {
  Float8 of[2];

  LAZYCCD_INLINE explicit Sides(const VertexBox& box) {
    for (int half = 0; half < 2; ++half) of[half] = reinterpret_cast<const Float8*>(box.side)[half];
  }
  LAZYCCD_INLINE void widen(const Sides& by) {
    for (int half = 0; half < 2; ++half)
      of[half] = choose(of[half] > by.of[half], of[half], by.of[half]);
  }
};

// Computes the boxes in a block of primitives with `corners` vertices each. Widens `all` by them.
template <int corners>
LAZYCCD_INLINE void box_block(const VertexBox* vertices, Block& block, Sides& all) {
  for (int first = 0; first < kBlockLanes; first += FloatLanes::lanes) {
    Float8 rows[2][FloatLanes::lanes];
    for (int i = 0; i < FloatLanes::lanes; ++i) {
      Sides sides(vertices[block.vertex[0][first + i]]);
      for (int k = 1; k < corners; ++k) sides.widen(Sides(vertices[block.vertex[k][first + i]]));
      all.widen(sides);
      for (int half = 0; half < 2; ++half) rows[half][i] = sides.of[half];
    }
    FloatLanes lower[kColumns], upper[kColumns];
    transpose(rows[0], lower);
    transpose(rows[1], upper);
    for (int k = 0; k < 3; ++k) {
      (-lower[k]).store(block.lo0[k] + first);
      (-lower[3 + k]).store(block.lo1[k] + first);
      upper[k].store(block.hi0[k] + first);
      upper[3 + k].store(block.hi1[k] + first);
    }
  }
}

}  // namespace

void box_vertices(const double* records, double scale, double margin, std::size_t first,
                  std::size_t last, VertexBox* boxes) {
  const Double8* x = reinterpret_cast<const Double8*>(records);
  // One float further outward covers the rounding of x - margin in double.
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
    const Group& group = groups[g];
    Sides all(vertices[-1]);
    for (int i = 0; i < group.blocks(kVertices); ++i)
      box_block<1>(vertices, blocks[group.first[kVertices] + i], all);
    for (int i = 0; i < group.blocks(kEdges); ++i)
      box_block<2>(vertices, blocks[group.first[kEdges] + i], all);
    for (int i = 0; i < group.blocks(kFaces); ++i)
      box_block<3>(vertices, blocks[group.first[kFaces] + i], all);
    for (int k = 0; k < 3; ++k) {
      boxes[g].lo0[k] = -all.of[0][k];
      boxes[g].lo1[k] = -all.of[0][3 + k];
      boxes[g].hi0[k] = all.of[1][k];
      boxes[g].hi1[k] = all.of[1][3 + k];
    }
  }
}

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
