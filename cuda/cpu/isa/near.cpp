#include "cpu/isa/near.h"

#include "core/narrow/start_distance.h"
#include "cpu/isa/differences.h"
#include "simd/bits.h"

namespace lazyccd {
namespace LAZYCCD_ISA {
namespace {

// Appends the chosen pairs and returns the new count. Writes up to FloatLanes::lanes elements
// beyond the count.
LAZYCCD_INLINE int append(const Candidate* pairs, unsigned chosen, Candidate* to, int count) {
#if defined(__AVX512F__)
  for (int half = 0; half < 2; ++half) {
    const auto bits = static_cast<__mmask8>(chosen >> 8 * half);
    const __m512i eight = _mm512_loadu_si512(pairs + 8 * half);
    _mm512_storeu_si512(to + count, _mm512_maskz_compress_epi64(bits, eight));
    count += count_bits(bits);
  }
#else
  for (int i = 0; i < FloatLanes::lanes; ++i) {
    to[count] = pairs[i];
    count += static_cast<int>(chosen >> i & 1);
  }
#endif
  return count;
}

// The separations of a pack of candidates, scaled. A distance below `within` is certainly within,
// one above `beyond` is certainly beyond. within_for_all: the same as `within` for all pairs that
// may represent the candidate.
struct Limits {
  FloatLanes within, within_for_all, beyond;

  LAZYCCD_INLINE Limits(const LeafScene& scene, const FloatLanes& separation,
                        const FloatLanes& least)
      : within(certainly_within(separation)),
        within_for_all(certainly_within(least)),
        beyond((separation + FloatLanes(scene.unknown_distance)) * FloatLanes(1 + 0x1p-10f)) {}

  template <ContactKind kind>
  static LAZYCCD_INLINE Limits of(const LeafScene& scene, const Candidate* c) {
    const FloatLanes between(static_cast<float>(scene.scale * scene.separation.between_bodies));
    if (scene.separation.within_body == nullptr) return Limits(scene, between, between);
    alignas(64) float largest[2][FloatLanes::lanes], smallest[2][FloatLanes::lanes];
    for (int i = 0; i < FloatLanes::lanes; ++i) {
      const SelfLimits limits = self_limits<kind>(scene.mesh, scene.separation.within_body, c[i]);
      for (int k = 0; k < 2; ++k) {
        largest[k][i] = limits.largest[k];
        smallest[k][i] = limits.smallest[k];
      }
    }
    const bool fits = fits_float(scene.scale);
    const FloatLanes scale(fits ? static_cast<float>(scene.scale) : 1.0f);
    if (!fits) {
      for (auto* const limits : {&largest, &smallest})
        for (auto& of_primitives : *limits)
          for (float& limit : of_primitives) limit = scaled_limit(scene.scale, limit);
    }
    const FloatLanes least(static_cast<float>(scene.scale * scene.separation.least()));
    const auto within = [&](const float(&limits)[2][FloatLanes::lanes]) {
      const FloatLanes limit =
          scale * lane_min(FloatLanes::load(limits[0]), FloatLanes::load(limits[1]));
      return lane_min(lane_max(limit, least), between);
    };
    return Limits(scene, within(largest), within(smallest));
  }
};

// Candidates that are not certainly near at the start of the step and wait for the test at its end.
class EndTests {
 public:
  int count() const { return count_; }

  LAZYCCD_INLINE void add(const Candidate* pairs, unsigned chosen, const Gap<FloatLanes>& gap,
                          const FloatLanes& min_distance, const FloatLanes& beyond) {
    store_chosen(gap.vector.x, chosen, x_ + count_);
    store_chosen(gap.vector.y, chosen, y_ + count_);
    store_chosen(gap.vector.z, chosen, z_ + count_);
    store_chosen(min_distance, chosen, min_distance_ + count_);
    store_chosen(beyond, chosen, beyond_ + count_);
    count_ = append(pairs, chosen, pairs_, count_);
  }

  // Splits the first candidates, at most as many as there are lanes, into far and undecided ones.
  template <ContactKind kind>
  LAZYCCD_INLINE void split(const LeafScene& scene, NearSplit& split) {
    const int used = count_ < FloatLanes::lanes ? count_ : FloatLanes::lanes;
    for (int i = used; i < FloatLanes::lanes; ++i) pairs_[i] = pairs_[0];
    const FloatLanes beyond = FloatLanes::load(beyond_);
    const Gap<FloatLanes> gap({FloatLanes::load(x_), FloatLanes::load(y_), FloatLanes::load(z_)});
    const FloatLanes at_end = gap.template min_distance<kind>(gather_at<kind, 1>(scene, pairs_));
    const unsigned far = ((FloatLanes::load(min_distance_) > beyond) & (at_end > beyond)).bits();
    for (int i = 0; i < used; ++i) {
      const bool is_far = far >> i & 1;
      split.far[split.far_count] = pairs_[i];
      split.far_min_distance[split.far_count] = min_distance_[i];
      split.undecided[split.undecided_count] = {pairs_[i], 0, false, min_distance_[i]};
      split.far_count += is_far;
      split.undecided_count += !is_far;
    }
    count_ -= used;
    for (int i = 0; i < count_; ++i) {
      pairs_[i] = pairs_[used + i];
      for (float* const lanes : {x_, y_, z_, min_distance_, beyond_}) lanes[i] = lanes[used + i];
    }
  }

 private:
  // Less than a pack is waiting when another whole pack is written.
  static constexpr int capacity = 2 * FloatLanes::lanes;
  int count_ = 0;
  alignas(64) float x_[capacity], y_[capacity], z_[capacity],
      min_distance_[capacity], beyond_[capacity];
  Candidate pairs_[capacity];
};

// Splits candidates. A lower bound of the distance along one axis at both ends of the step holds
// during the whole step.
template <ContactKind kind>
void near_kind(const LeafScene& scene, const Candidate* candidates, int count, NearSplit& split) {
  EndTests end_tests;
  split.near_count = split.kept_count = split.far_count = split.undecided_count = 0;
  for (int begin = 0; begin < count; begin += FloatLanes::lanes) {
    Candidate pair[FloatLanes::lanes];
    const int left = count - begin < FloatLanes::lanes ? count - begin : FloatLanes::lanes;
    const unsigned used = (1u << left) - 1;
    for (int i = 0; i < FloatLanes::lanes; ++i) pair[i] = candidates[begin + (i < left ? i : 0)];
    const DifferencesAt<FloatLanes> d = gather_at<kind, 0>(scene, pair);
    const StartDistance<FloatLanes> at_start = start_distance<kind>(d);
    const Limits limits = Limits::of<kind>(scene, pair);
    const FloatLanes min_distance = at_start.gap.template min_distance<kind>(d);

    unsigned is_redundant = 0;
    if (scene.first_faces.of) {
      const FloatLanes on = on_border<kind>(at_start.points.u, at_start.points.v);
      alignas(64) float border[FloatLanes::lanes];
      on.store(border);
      const Mask may_be = at_start.template may_be_redundant<kind>(limits.within_for_all, on);
      for (unsigned bits = may_be.bits() & used; bits; bits &= bits - 1) {
        const int i = lowest_bit(bits);
        const bool is = is_redundant_pair<kind>(scene.mesh, scene.first_faces, pair[i],
                                                static_cast<int>(border[i]));
        is_redundant |= static_cast<unsigned>(is) << i;
      }
    }
    alignas(64) float gaps[FloatLanes::lanes];
    min_distance.store(gaps);
    if (!scene.single_first) {
      for (int i = 0; i < left; ++i)
        split.undecided[split.undecided_count++] = {pair[i], 0, (is_redundant >> i & 1) != 0,
                                                    gaps[i]};
      continue;
    }
    const Mask near = at_start.gap.is_below(limits.within - distance_rounding(at_start.magnitude));
    const unsigned near_bits = near.bits() & used;
    store_chosen(min_distance, near_bits, split.near_min_distance + split.near_count);
    split.near_count = append(pair, near_bits, split.near, split.near_count);
    for (unsigned kept = near_bits & ~is_redundant; kept; kept &= kept - 1) {
      const int i = lowest_bit(kept);
      split.kept[split.kept_count++] = {pair[i], 0, false, gaps[i]};
    }
    end_tests.add(pair, used & ~near_bits, at_start.gap, min_distance, limits.beyond);
    if (end_tests.count() >= FloatLanes::lanes) end_tests.split<kind>(scene, split);
  }
  while (end_tests.count() > 0) end_tests.split<kind>(scene, split);
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
