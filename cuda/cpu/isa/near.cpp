#include "cpu/isa/near.h"

#include "core/closest.h"
#include "cpu/isa/differences.h"

namespace lazyccd {
namespace LAZYCCD_ISA {
namespace {

LAZYCCD_INLINE FloatLanes size_of(const Vec3<FloatLanes>& a) {
  return lane_abs(a.x) + lane_abs(a.y) + lane_abs(a.z);
}

// How far the corners of one primitive are from those of the other along an axis, at least, times
// the length of the axis.
template <ContactKind kind>
LAZYCCD_INLINE FloatLanes least_along(const Vec3<FloatLanes>& axis, const Vec3<FloatLanes>& e1, const Vec3<FloatLanes>& e2,
                                const Vec3<FloatLanes>& r) {
  const FloatLanes zero(0.0f), at = dot(axis, r), along1 = dot(axis, e1), along2 = dot(axis, e2);
  return kind == ContactKind::vertex_face ? lane_min(at, lane_min(at - along1, at - along2))
                                          : at - lane_max(zero, along1) + lane_min(zero, along2);
}

// Appends those that are chosen; writes up to FloatLanes::lanes beyond them.
LAZYCCD_INLINE int append(const Candidate* pairs, unsigned chosen, Candidate* to, int count) {
#if defined(__AVX512F__)
  for (int half = 0; half < 2; ++half) {
    const auto bits = static_cast<__mmask8>(chosen >> 8 * half);
    const __m512i eight = _mm512_loadu_si512(pairs + 8 * half);
    _mm512_storeu_si512(to + count, _mm512_maskz_compress_epi64(bits, eight));
    count += __builtin_popcount(bits);
  }
#else
  for (int i = 0; i < FloatLanes::lanes; ++i) {
    to[count] = pairs[i];
    count += static_cast<int>(chosen >> i & 1);
  }
#endif
  return count;
}

LAZYCCD_INLINE FloatLanes rounding(const FloatLanes& reach) { return FloatLanes(32 * Roundoff<float>::u) * reach; }

// The gap between points of two primitives where the step begins.
struct Gap {
  Vec3<FloatLanes> vector;
  FloatLanes squared, length;

  explicit LAZYCCD_INLINE Gap(const Vec3<FloatLanes>& v)
      : vector(v), squared(dot(v, v)), length(lane_sqrt(squared)) {}

  // How far apart the primitives are along it, certainly, where they differ so.
  template <ContactKind kind>
  LAZYCCD_INLINE FloatLanes apart(const DifferencesAt<FloatLanes>& d) const {
    const FloatLanes zero(0.0f), reach = size_of(d.e1) + size_of(d.e2) + size_of(d.r);
    const FloatLanes least = least_along<kind>(vector, d.e1, d.e2, d.r);
    return select(squared > FloatLanes(Roundoff<float>::tiny),
                  lane_max(zero, least / length - rounding(reach)), zero);
  }
};

// What is not near where the step begins, on its way to a look at the end.
class Others {
 public:
  int count() const { return count_; }

  LAZYCCD_INLINE void add(const Candidate* pairs, unsigned chosen, const Gap& gap,
                          const FloatLanes& apart) {
    store_chosen(gap.vector.x, chosen, x_ + count_);
    store_chosen(gap.vector.y, chosen, y_ + count_);
    store_chosen(gap.vector.z, chosen, z_ + count_);
    store_chosen(apart, chosen, apart_ + count_);
    count_ = append(pairs, chosen, pairs_, count_);
  }

  // Splits the first ones, no more than there are lanes.
  template <ContactKind kind>
  LAZYCCD_INLINE void split(const LeafScene& scene, NearSplit& split) {
    const int used = count_ < FloatLanes::lanes ? count_ : FloatLanes::lanes;
    for (int i = used; i < FloatLanes::lanes; ++i) pairs_[i] = pairs_[0];
    const FloatLanes beyond(scene.certainly_beyond);
    const Gap gap({FloatLanes::load(x_), FloatLanes::load(y_), FloatLanes::load(z_)});
    const FloatLanes at_end = gap.apart<kind>(gather_at<kind, 1>(scene, pairs_));
    const unsigned away = ((FloatLanes::load(apart_) > beyond) & (at_end > beyond)).bits();
    for (int i = 0; i < used; ++i) {
      const bool is_away = away >> i & 1;
      split.away[split.away_count] = pairs_[i];
      split.away_apart[split.away_count] = apart_[i];
      split.open[split.open_count] = {pairs_[i], 0, false, apart_[i]};
      split.away_count += is_away;
      split.open_count += !is_away;
    }
    count_ -= used;
    for (int i = 0; i < count_; ++i) {
      pairs_[i] = pairs_[used + i];
      for (float* const lanes : {x_, y_, z_, apart_}) lanes[i] = lanes[used + i];
    }
  }

 private:
  static constexpr int capacity = 2 * FloatLanes::lanes;  // less than a pack, and another one written
  int count_ = 0;
  alignas(64) float x_[capacity], y_[capacity], z_[capacity], apart_[capacity];
  Candidate pairs_[capacity];
};

// Of the differences, times scale, each component is off by one rounding; of the gap between the
// points that were found, by less than 8 roundings of `reach`, the sum of their components. That
// the points are the closest ones is not relied on: any two tell how far the primitives are at
// most, and any axis how far at least, and all the time if at both ends.
template <ContactKind kind>
void near_kind(const LeafScene& scene, const Candidate* candidates, int count, NearSplit& split) {
  const FloatLanes zero(0.0f), tiny(Roundoff<float>::tiny);
  FloatLanes nearest(__builtin_inff());
  Others others;
  split.near_count = split.own_count = split.away_count = split.open_count = 0;
  for (int begin = 0; begin < count; begin += FloatLanes::lanes) {
    Candidate pair[FloatLanes::lanes];
    const int left = count - begin < FloatLanes::lanes ? count - begin : FloatLanes::lanes;
    const unsigned used = (1u << left) - 1;
    for (int i = 0; i < FloatLanes::lanes; ++i) pair[i] = candidates[begin + (i < left ? i : 0)];
    const DifferencesAt<FloatLanes> d = gather_at<kind, 0>(scene, pair);
    const ClosestPoints<FloatLanes> points = closest_points<kind>(d.e1, d.e2, d.r);
    const Gap gap(points.gap);
    const FloatLanes size1 = size_of(d.e1), size2 = size_of(d.e2), reach = size1 + size2 + size_of(d.r);
    const auto certainly_within = [&](const FloatLanes& distance) {
      return (distance > zero) & (gap.squared + tiny < distance * distance);
    };
    const FloatLanes within = FloatLanes(scene.certain_separation) - rounding(reach);
    const FloatLanes apart = gap.apart<kind>(d);

    unsigned is_redundant = 0;
    if (scene.first_faces.of) {
      const FloatLanes on = on_border<kind>(points.u, points.v);
      alignas(64) float border[FloatLanes::lanes];
      on.store(border);
      const Mask may_be =
          (on > zero) &
          certainly_within(within - border_width<kind>(points.u, points.v, size1, size2));
      for (unsigned bits = may_be.bits() & used; bits; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        const bool is = is_spoken_for<kind>(scene.mesh, scene.first_faces, pair[i],
                                            static_cast<int>(border[i]));
        is_redundant |= static_cast<unsigned>(is) << i;
      }
    }
    alignas(64) float gaps[FloatLanes::lanes];
    apart.store(gaps);
    if (!scene.single_first) {
      for (int i = 0; i < left; ++i)
        split.open[split.open_count++] = {pair[i], 0, (is_redundant >> i & 1) != 0, gaps[i]};
      continue;
    }
    const Mask near = certainly_within(within);
    const unsigned near_bits = near.bits() & used;
    nearest = lane_min(nearest, select(near, apart, nearest));
    split.near_count = append(pair, near_bits, split.near, split.near_count);
    for (unsigned own = near_bits & ~is_redundant; own; own &= own - 1) {
      const int i = __builtin_ctz(own);
      split.own[split.own_count++] = {pair[i], 0, false, gaps[i]};
    }
    others.add(pair, used & ~near_bits, gap, apart);
    if (others.count() >= FloatLanes::lanes) others.split<kind>(scene, split);
  }
  while (others.count() > 0) others.split<kind>(scene, split);
  alignas(64) float lanes[FloatLanes::lanes];
  nearest.store(lanes);
  split.apart = lanes[0];
  for (const float lane : lanes) split.apart = lane < split.apart ? lane : split.apart;
}

}  // namespace

void near_at_start(const LeafScene& scene, ContactKind kind, const Candidate* candidates, int count,
                   NearSplit& split) {
  return kind == ContactKind::vertex_face
             ? near_kind<ContactKind::vertex_face>(scene, candidates, count, split)
             : near_kind<ContactKind::edge_edge>(scene, candidates, count, split);
}

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
