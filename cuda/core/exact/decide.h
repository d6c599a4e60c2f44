// Exact decision of a query with integers of fixed width, for host and device. The definitions are
// those of cpu/narrow/exact.cpp, which works with integers of any size.
//
// With differences of coordinates of c bits on the grid, a cubic has coefficients of a = 3c + 5
// bits and a quadratic of b = 2c + 4. The largest integers are discriminants (4a + 7 bits),
// resultants (2a + 3b + 5 bits) and a cubic over an interval (a + 3 kMaxLevel + 4 bits). All fit
// for c = 82.
#pragma once

#include <cstdint>
#include <cstring>

#include "core/exact/instant.h"
#include "core/exact/moving_vector.h"
#include "core/narrow/decision.h"
#include "core/narrow/elementary.h"
#include "lazyccd/contact.h"

namespace lazyccd::exact {

/// Most bits of a coordinate on the grid; a difference of two has one more.
constexpr int kCoordinateBits = 81;

/// Zero bits below the lowest one bit of m, which is not 0.
LAZYCCD_HD inline int trailing_zeros(std::uint64_t m) {
#if defined(__CUDA_ARCH__)
  return __ffsll(static_cast<long long>(m)) - 1;
#else
  int zeros = 0;
  for (; (m >> zeros & 1) == 0; ++zeros) {
  }
  return zeros;
#endif
}
/// Bits up to the highest one bit of m.
LAZYCCD_HD inline int significant_bits(std::uint64_t m) {
#if defined(__CUDA_ARCH__)
  return 64 - __clzll(static_cast<long long>(m));
#else
  int bits = 0;
  for (; m != 0; m >>= 1) ++bits;
  return bits;
#endif
}

/// A finite double as mantissa times 2^exponent. The mantissa is odd, or 0 for zero.
struct Dyadic {
  std::int64_t mantissa;
  int exponent, bits;  // bits: of the mantissa

  LAZYCCD_HD explicit Dyadic(double x) : mantissa(0), exponent(0), bits(0) {
    std::uint64_t raw;
    ::memcpy(&raw, &x, sizeof raw);
    const int field = static_cast<int>(raw >> 52 & 0x7ff);
    std::uint64_t m = raw & 0xfffffffffffffull;
    if (field != 0) m |= 0x10000000000000ull;
    if (m == 0) return;
    exponent = (field != 0 ? field : 1) - 1075;

    const int zeros = trailing_zeros(m);
    m >>= zeros;
    exponent += zeros;
    bits = significant_bits(m);
    mantissa = raw >> 63 != 0 ? -static_cast<std::int64_t>(m) : static_cast<std::int64_t>(m);
  }
};

/// The four points of a query on an integer grid, at both ends of the step. Each axis has its own
/// grid: the coarsest one that holds all its coordinates.
template <class Integer>
class GridMotion {
 public:
  /// Returns false if a coordinate has too many bits.
  LAZYCCD_HD LAZYCCD_CALLED bool load(const QueryCoordinates& q) {
    LAZYCCD_ONE_COPY
    for (int axis = 0; axis < 3; ++axis) {
      int lowest = 1 << 20, highest = -(1 << 20);
      const auto dyadic = [&](int i) {
        const Vec3<double>& point = i < 4 ? q.start[i] : q.end[i - 4];
        return Dyadic(axis == 0 ? point.x : axis == 1 ? point.y : point.z);
      };

      LAZYCCD_ONE_COPY
      for (int i = 0; i < 8; ++i) {
        const Dyadic d = dyadic(i);
        if (d.mantissa == 0) continue;
        if (d.exponent < lowest) lowest = d.exponent;
        if (d.exponent + d.bits > highest) highest = d.exponent + d.bits;
      }
      if (highest - lowest > kCoordinateBits) return false;

      LAZYCCD_ONE_COPY
      for (int i = 0; i < 8; ++i) {
        const Dyadic d = dyadic(i);
        x_[i][axis] = d.mantissa == 0 ? Integer(0) : Integer(d.mantissa) << (d.exponent - lowest);
      }
    }
    return true;
  }
  /// The vector from point i to point j.
  LAZYCCD_HD LAZYCCD_CALLED MovingVector<Integer> difference(int i, int j) const {
    MovingVector<Integer> v;
    for (int axis = 0; axis < 3; ++axis) {
      v.start[axis] = x_[j][axis] - x_[i][axis];
      v.end[axis] = x_[j + 4][axis] - x_[i + 4][axis];
    }
    return v;
  }

 private:
  Integer x_[8][3];
};

/// Decides one query. Its kind is no template parameter, so that a device loads the code once.
template <class Integer>
class FixedDecider {
  using P = Poly<Integer>;
  using At = Instant<Integer>;
  using Vector = MovingVector<Integer>;

 public:
  LAZYCCD_HD explicit FixedDecider(ContactKind kind)
      : is_vf_(kind == ContactKind::vertex_face), segments_(is_vf_ ? 3 : 4) {}

  LAZYCCD_HD LAZYCCD_CALLED Decision operator()(const QueryCoordinates& q) {
    if (!motion_.load(q)) return {Decision::undecided, 0};

    e1_ = is_vf_ ? motion_.difference(1, 2) : motion_.difference(0, 1);
    e2_ = is_vf_ ? motion_.difference(1, 3) : motion_.difference(2, 3);
    r_ = is_vf_ ? motion_.difference(1, 0) : motion_.difference(0, 2);
    for (int k = 0; k < 3; ++k) normal_[k] = cross(e1_, e2_, k);
    const P f = dot(normal_, r_);
    if (f.sign_changes() == 0 && f.c[0].sign() != 0 && f.c[3].sign() != 0)
      return {Decision::miss, 0};
    if (!f.is_zero()) return decision(first_root(f, Touches{this, kAnySegment}));

    // The points are in one plane at all times. After the start, the first contact is between a
    // point and a segment.
    At start = At::start_of(Path());
    const Answer at_start = touches(start);
    if (at_start != Answer::no) return decision({at_start, 0});
    FirstRoot first{Answer::no, 0};

    for (int s = 0; s < segments_; ++s) {
      const P between = segment_between(s);
      if (never_between(between)) continue;
      P p = between;

      for (int k = 3; k-- > 0;)
        if (const P c = segment_cross(s, k); !c.is_zero()) p = c;
      if (p.is_zero()) continue;
      const FirstRoot found = first_root(p, Touches{this, s});
      if (found.answer == Answer::unknown) return {Decision::undecided, 0};
      if (found.answer == Answer::yes && (first.answer == Answer::no || found.ticks < first.ticks))
        first = found;
    }
    return decision(first);
  }

 private:
  // Whether the primitives touch at a time: in any way, or the point of one segment lies on it.
  static constexpr int kAnySegment = -1;
  struct Touches {
    const FixedDecider* query;
    int segment;

    LAZYCCD_HD Answer operator()(At& t) const {
      return segment == kAnySegment ? query->touches(t) : query->holds(segment, t);
    }
  };

  LAZYCCD_HD static Decision decision(const FirstRoot& root) {
    if (root.answer == Answer::unknown) return {Decision::undecided, 0};
    return {root.answer == Answer::yes ? Decision::hit : Decision::miss, root.ticks};
  }

  // Point and ends of a segment: the vertex and a side of the face, or the end of one edge and the
  // other edge.
  struct Segment {
    int point, a, b;
  };
  LAZYCCD_HD Segment segment(int s) const {
    if (is_vf_) return {0, 1 + s, 1 + (s + 1) % 3};
    return s < 2 ? Segment{s, 2, 3} : Segment{s, 0, 1};
  }
  LAZYCCD_HD LAZYCCD_CALLED P segment_cross(int s, int k) const {
    const Segment g = segment(s);
    return cross(motion_.difference(g.a, g.point), motion_.difference(g.b, g.point), k);
  }
  LAZYCCD_HD LAZYCCD_CALLED P segment_between(int s) const {
    const Segment g = segment(s);
    return dot(motion_.difference(g.a, g.point), motion_.difference(g.b, g.point));
  }
  LAZYCCD_HD static bool never_between(const P& between) {
    return between.sign_changes() == 0 && between.c[0].sign() > 0 && between.c[2].sign() > 0;
  }

  // Whether the point lies on the segment: (p-a) x (p-b) = 0 and (p-a) . (p-b) <= 0.
  LAZYCCD_HD LAZYCCD_CALLED Answer holds(int s, At& t) const {
    for (int k = 0; k < 3; ++k) {
      const int sign = t.sign(segment_cross(s, k));
      if (sign != 0) return sign == kUnknown ? Answer::unknown : Answer::no;
    }
    const int sign = t.sign(segment_between(s));
    if (sign == kUnknown) return Answer::unknown;
    return sign <= 0 ? Answer::yes : Answer::no;
  }

  // Whether the primitives touch at a time when the four points are in one plane.
  LAZYCCD_HD LAZYCCD_CALLED Answer touches(At& t) const {
    for (int k = 0; k < 3; ++k) {
      const int normal = t.sign(normal_[k]);
      if (normal == kUnknown) return Answer::unknown;
      if (normal != 0) return is_inside(t, k, normal);
    }

    for (int s = 0; s < segments_; ++s) {
      if (never_between(segment_between(s))) continue;
      const Answer answer = holds(s, t);
      if (answer != Answer::no) return answer;
    }
    return Answer::no;
  }

  // Whether the barycentric coordinates are not negative, by component k of the cross products;
  // `normal` is the sign of that of the normal.
  LAZYCCD_HD LAZYCCD_CALLED Answer is_inside(At& t, int k, int normal) const {
    const P u = cross(r_, e2_, k), v = is_vf_ ? cross(e1_, r_, k) : cross(r_, e1_, k);

    for (int i = 0; i < (is_vf_ ? 3 : 4); ++i) {
      const P g = i == 0   ? u
                  : i == 1 ? v
                  : i == 2 ? (is_vf_ ? normal_[k] - u - v : normal_[k] - u)
                           : normal_[k] - v;
      const int sign = t.sign(g);
      if (sign == kUnknown) return Answer::unknown;
      if (sign * normal < 0) return Answer::no;
    }
    return Answer::yes;
  }

  bool is_vf_;
  int segments_;  // point-segment pairs that may touch if all points stay in one plane
  GridMotion<Integer> motion_;
  // Two sides of the face, and from their corner to the vertex. Or the edges, and from the first to
  // the second one.
  Vector e1_, e2_, r_;
  P normal_[3];
};

/// Decides a query exactly. Undecided only if it needs more than the integers' fixed width: if the
/// coordinates of one axis span more than kCoordinateBits binary places, or a sign more than
/// kMaxLevel halvings. The points must be finite.
template <class Integer>
LAZYCCD_HD Decision decide_fixed(ContactKind kind, const QueryCoordinates& q) {
  return FixedDecider<Integer>(kind)(q);
}

}  // namespace lazyccd::exact
