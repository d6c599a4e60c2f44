#include "cpu/isa/near.h"

#include "core/closest.h"
#include "cpu/isa/differences.h"

namespace lazyccd {
namespace LAZYCCD_ISA {
namespace {

LAZYCCD_INLINE Pack size_of(const Vec3<Pack>& a) {
  return lane_abs(a.x) + lane_abs(a.y) + lane_abs(a.z);
}

// How far the corners of one primitive are from those of the other along an axis, at least, times
// the length of the axis.
template <ContactKind kind>
LAZYCCD_INLINE Pack least_along(const Vec3<Pack>& axis, const Vec3<Pack>& e1, const Vec3<Pack>& e2,
                                const Vec3<Pack>& r) {
  const Pack zero(0.0f), at = dot(axis, r), along1 = dot(axis, e1), along2 = dot(axis, e2);
  return kind == ContactKind::vertex_face ? lane_min(at, lane_min(at - along1, at - along2))
                                          : at - lane_max(zero, along1) + lane_min(zero, along2);
}

// Of the differences, times scale, each component is off by one rounding; of the gap between the
// points that were found, by less than 8 roundings of `reach`, the sum of their components. That
// the points are the closest ones is not relied on: any two tell how far the primitives are at
// most, and any axis how far at least, and all the time if at both ends.
template <ContactKind kind>
void near_kind(const LeafScene& scene, const Candidate* candidates, int count, NearSplit& split) {
  const Pack zero(0.0f), tiny(Roundoff<float>::tiny), rounding(32 * Roundoff<float>::u);
  const Pack separation(scene.certain_separation), beyond(scene.certainly_beyond);
  const Mask relied_on = Pack(scene.single_first ? 1.0f : 0.0f) > zero;
  Pack nearest(__builtin_inff());
  int near_count = 0, own_count = 0, away_count = 0, open_count = 0;
  for (int begin = 0; begin < count; begin += Pack::lanes) {
    Candidate pair[Pack::lanes];
    const int used = count - begin < Pack::lanes ? count - begin : Pack::lanes;
    for (int i = 0; i < Pack::lanes; ++i)
      pair[i] = in_order<kind>(scene.mesh, candidates[begin + (i < used ? i : 0)]);
    const Differences<Pack> d = gather<kind>(scene, pair);
    const Vec3<Pack>&e1 = d.e1[0], &e2 = d.e2[0], &r = d.r[0];
    const ClosestPoints<Pack> points = closest_points<kind>(e1, e2, r);
    const Vec3<Pack>& gap = points.gap;
    const Pack squared = dot(gap, gap);
    const Pack size1 = size_of(e1), size2 = size_of(e2), reach = size1 + size2 + size_of(r);
    const auto certainly_within = [&](const Pack& distance) {
      return (distance > zero) & (squared + tiny < distance * distance);
    };
    const Pack within = separation - rounding * reach;
    const Mask near = relied_on & certainly_within(within);
    const Mask may_be_spoken_for =
        is_on_border<kind>(points.u, points.v) &
        certainly_within(within - border_width<kind>(points.u, points.v, size1, size2));

    const Mask some = squared > tiny;
    const Pack length = lane_sqrt(squared);
    const auto apart_along_gap = [&](int end, const Pack& sizes) {
      const Pack least = least_along<kind>(gap, d.e1[end], d.e2[end], d.r[end]);
      return select(some, lane_max(zero, least / length - rounding * sizes), zero);
    };
    const Pack apart = apart_along_gap(0, reach);
    const Pack reach_at_end = size_of(d.e1[1]) + size_of(d.e2[1]) + size_of(d.r[1]);
    const Mask away = relied_on & (apart > beyond) & (apart_along_gap(1, reach_at_end) > beyond);
    nearest = lane_min(nearest, select(near, apart, nearest));

    alignas(64) float u[Pack::lanes], v[Pack::lanes], gaps[Pack::lanes];
    points.u.store(u);
    points.v.store(v);
    apart.store(gaps);
    unsigned spoken_for = 0;
    if (scene.first_faces.of) {
      for (unsigned left = may_be_spoken_for.bits() & ((1u << used) - 1); left; left &= left - 1) {
        const int i = __builtin_ctz(left);
        const bool is = is_spoken_for<kind>(scene.mesh, scene.first_faces, pair[i], u[i], v[i]);
        spoken_for |= static_cast<unsigned>(is) << i;
      }
    }
    const unsigned near_bits = near.bits(), away_bits = away.bits();
    for (int i = 0; i < used; ++i) {
      const bool is_near = near_bits >> i & 1, is_away = away_bits >> i & 1,
                 is_spoken = spoken_for >> i & 1;
      split.near[near_count] = pair[i];
      split.own[own_count] = {pair[i], 0, true, false, gaps[i]};
      split.away[away_count] = {pair[i], gaps[i]};
      split.open[open_count] = {pair[i], 0, false, is_spoken, gaps[i]};
      near_count += is_near;
      own_count += is_near & !is_spoken;
      away_count += is_away;
      open_count += !is_near & !is_away;
    }
  }
  split.near_count = near_count;
  split.own_count = own_count;
  split.away_count = away_count;
  split.open_count = open_count;
  alignas(64) float lanes[Pack::lanes];
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
