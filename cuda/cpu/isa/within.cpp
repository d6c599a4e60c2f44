#include "cpu/isa/within.h"

#include "core/separation.h"
#include "cpu/isa/records.h"
#include "cpu/isa/wide.h"

namespace lazyccd {
namespace LAZYCCD_ISA {
namespace {

// Rows of a record each, turned into packs, a component each.
struct alignas(64) Rows {
  Double8 row[4][Wide::lanes];

  LAZYCCD_INLINE Wide component(int of, int index) const {
    alignas(64) double lanes[Wide::lanes];
    for (int i = 0; i < Wide::lanes; ++i) lanes[i] = row[of][i][index];
    return Wide::load(lanes);
  }
  LAZYCCD_INLINE Vec3<Wide> vector(int of, int end) const {
    return {component(of, 3 * end), component(of, 3 * end + 1), component(of, 3 * end + 2)};
  }
};

template <ContactKind kind>
LAZYCCD_INLINE CoordinatesOf<Wide> gather(const LeafScene& scene, const Candidate* c) {
  Rows rows;
  const Double8* records = records_of(scene);
  for (int i = 0; i < Wide::lanes; ++i) {
    const Ends e = ends<kind>(scene, c[i]);
    const bool vf = kind == ContactKind::vertex_face;
    const std::int32_t points[4] = {vf ? e.r[1] : e.e1[0], e.e1[vf ? 0 : 1], vf ? e.e1[1] : e.e2[0],
                                    e.e2[1]};
    for (int p = 0; p < 4; ++p) rows.row[p][i] = records[points[p]];
  }
  CoordinatesOf<Wide> q;
  for (int p = 0; p < 4; ++p) {
    q.start[p] = rows.vector(p, 0);
    q.end[p] = rows.vector(p, 1);
  }
  return q;
}

// Up to as many candidates as there are lanes; what is missing repeats the first.
struct Batch {
  Candidate pair[Wide::lanes];
  alignas(64) double t[Wide::lanes];
  unsigned used;

  template <class At>
  LAZYCCD_INLINE Batch(int begin, int end, const At& at) {
    const int count = end - begin < Wide::lanes ? end - begin : Wide::lanes;
    for (int i = 0; i < Wide::lanes; ++i) {
      const Approach a = at(begin + (i < count ? i : 0));
      pair[i] = a.pair;
      t[i] = a.t;
    }
    used = (1u << count) - 1;
  }
};

template <ContactKind kind>
int within_kind(const LeafScene& scene, Approach* found, int count) {
  const Wide h(scene.separation * scene.scale), zero(0.0), one(1.0);

  // One advance rules out most, so it goes first; the order of the tests does not matter.
  int near = 0;
  for (int begin = 0; begin < count; begin += Wide::lanes) {
    const Batch batch(begin, count, [&](int i) { return found[i]; });
    const Differences<Wide> d = differences<kind>(gather<kind>(scene, batch.pair), scene.scale);
    const Wide next = advance<kind>(d, magnitudes(d), h, zero);
    const unsigned ended = stopped(next, zero).bits();
    alignas(64) double t[Wide::lanes];
    next.store(t);
    for (unsigned left = (!(next > one)).bits() & batch.used; left; left &= left - 1) {
      const int i = __builtin_ctz(left);
      found[near] = found[begin + i];
      found[near].ended = ended >> i & 1;
      found[near].t = found[near].ended ? 0 : t[i];
      ++near;
    }
  }

  int left = 0;
  std::int16_t open[CandidateQueue::capacity];
  int open_count = 0;
  for (int begin = 0; begin < near; begin += Wide::lanes) {
    const Batch batch(begin, near, [&](int i) { return found[i]; });
    const CoordinatesOf<Wide> q = gather<kind>(scene, batch.pair);
    const Differences<Wide> d = differences<kind>(q, scene.scale);
    const Wide unscaled(scene.separation);
    const WideMask apart = separated_along_axes<kind>(q, unscaled) |
                           separated_along_diagonals<kind>(q, unscaled) |
                           planes_apart(d, magnitudes(d), h);
    for (unsigned kept = (!apart).bits() & batch.used; kept; kept &= kept - 1) {
      found[left] = found[begin + __builtin_ctz(kept)];
      if (!found[left].ended) open[open_count++] = static_cast<std::int16_t>(left);
      ++left;
    }
  }

  // In rounds of a few advances, between which lanes that have ended are filled again.
  constexpr int round = 4;
  constexpr double missed = 2;
  for (int advances = 1; open_count > 0 && advances < kMaxAdvances; advances += round) {
    int still_open = 0;
    for (int begin = 0; begin < open_count; begin += Wide::lanes) {
      const Batch batch(begin, open_count, [&](int i) { return found[open[i]]; });
      const Differences<Wide> d = differences<kind>(gather<kind>(scene, batch.pair), scene.scale);
      const Magnitudes<Wide> m = magnitudes(d);
      Wide t = Wide::load(batch.t);
      WideMask going = zero < one, misses = one < zero;
      for (int i = advances; i < advances + round && i < kMaxAdvances && lane_any(going); ++i) {
        const Wide next = advance<kind>(d, m, h, t);
        misses = misses | (going & (next > one));
        going = going & !(next > one) & !stopped(next, t);
        t = select(going, next, t);
      }
      alignas(64) double times[Wide::lanes];
      select(misses, Wide(missed), t).store(times);
      const unsigned goes_on = going.bits();
      for (unsigned used = batch.used; used; used &= used - 1) {
        const int i = __builtin_ctz(used);
        found[open[begin + i]].t = times[i];
        if (goes_on >> i & 1) open[still_open++] = open[begin + i];
      }
    }
    open_count = still_open;
  }

  int hits = 0;
  for (int i = 0; i < left; ++i)
    if (found[i].t != missed) found[hits++] = found[i];
  return hits;
}

template <ContactKind kind>
void describe_kind(const LeafScene& scene, const Approach* approaches, int count, Place* places) {
  for (int begin = 0; begin < count; begin += Wide::lanes) {
    Batch batch(begin, count, [&](int i) { return approaches[i]; });
    for (double& t : batch.t) t = static_cast<double>(approach_tick(t)) * kTick;
    const Differences<Wide> d = differences<kind>(gather<kind>(scene, batch.pair), 1.0);
    const ContactPoint<Wide> point =
        contact_point<kind>(in_unit_scale(d), Wide::load(batch.t), true);
    const Wide values[] = {point.u, point.v, point.normal.x, point.normal.y, point.normal.z};
    alignas(64) double lanes[5][Wide::lanes];
    for (int k = 0; k < 5; ++k) values[k].store(lanes[k]);
    for (unsigned used = batch.used; used; used &= used - 1) {
      const int i = __builtin_ctz(used);
      const auto value = [&](int k) { return static_cast<float>(lanes[k][i]); };
      places[begin + i] = {value(0), value(1), {value(2), value(3), value(4)}};
    }
  }
}

}  // namespace

void describe(const LeafScene& scene, ContactKind kind, const Approach* approaches, int count,
              Place* places) {
  return kind == ContactKind::vertex_face
             ? describe_kind<ContactKind::vertex_face>(scene, approaches, count, places)
             : describe_kind<ContactKind::edge_edge>(scene, approaches, count, places);
}

int within(const LeafScene& scene, ContactKind kind, Approach* approaches, int count) {
  return kind == ContactKind::vertex_face
             ? within_kind<ContactKind::vertex_face>(scene, approaches, count)
             : within_kind<ContactKind::edge_edge>(scene, approaches, count);
}

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
