#include "cpu/isa/within.h"

#include "core/narrow/separation.h"
#include "cpu/isa/double_lanes.h"
#include "cpu/isa/records.h"
#include "cpu/isa/transpose.h"

namespace lazyccd {
namespace LAZYCCD_ISA {
namespace {

// Gathers the positions of a pack of candidates, four vertices each.
template <ContactKind kind>
LAZYCCD_INLINE CoordinatesOf<DoubleLanes> gather(const LeafScene& scene, const Candidate* c) {
  alignas(64) Double8 rows[4][DoubleLanes::lanes];
  const Double8* records = records_of(scene);
  for (int i = 0; i < DoubleLanes::lanes; ++i) {
    const Ends e = ends<kind>(scene, c[i]);
    const bool vf = kind == ContactKind::vertex_face;
    const std::int32_t points[4] = {vf ? e.r[1] : e.e1[0], e.e1[vf ? 0 : 1], vf ? e.e1[1] : e.e2[0],
                                    e.e2[1]};
    for (int p = 0; p < 4; ++p) rows[p][i] = records[points[p]];
  }
  CoordinatesOf<DoubleLanes> q;
  for (int p = 0; p < 4; ++p) {
    DoubleLanes column[kColumns];
    transpose(rows[p], column);
    q.start[p] = {column[0], column[1], column[2]};
    q.end[p] = {column[3], column[4], column[5]};
  }
  return q;
}

// At most as many candidates as there are lanes. Unused lanes repeat the first candidate.
struct Batch {
  Candidate pair[DoubleLanes::lanes];
  int count;

  template <class At>
  LAZYCCD_INLINE Batch(int begin, int end, const At& at)
      : count(end - begin < DoubleLanes::lanes ? end - begin : DoubleLanes::lanes) {
    for (int i = 0; i < DoubleLanes::lanes; ++i) pair[i] = at(begin + (i < count ? i : 0)).pair;
  }
  LAZYCCD_INLINE WideMask used() const {
    alignas(64) static constexpr double lanes[] = {0, 1, 2, 3, 4, 5, 6, 7};
    return DoubleLanes::load(lanes) < DoubleLanes(static_cast<double>(count));
  }
};

// The searches that have not ended: the index of each approach, and the state of its search.
struct Searches {
  int count;
  std::int16_t of[CandidateQueue::capacity];
  alignas(64) double t[CandidateQueue::capacity];
  alignas(64) double ahead[CandidateQueue::capacity];
  alignas(64) double trust[CandidateQueue::capacity];

  // The last pack is filled too, because lanes are loaded whole.
  explicit Searches(int approaches) : count(approaches) {
    static_assert(CandidateQueue::capacity % DoubleLanes::lanes == 0);
    const Search<double> first;
    const int packs = (count + DoubleLanes::lanes - 1) / DoubleLanes::lanes;
    for (int i = 0; i < packs * DoubleLanes::lanes; ++i) {
      of[i] = static_cast<std::int16_t>(i);
      t[i] = first.t;
      ahead[i] = first.ahead;
      trust[i] = first.trust;
    }
  }
  LAZYCCD_INLINE Search<DoubleLanes> load(int at) const {
    return {DoubleLanes::load(t + at), DoubleLanes::load(ahead + at),
            DoubleLanes::load(trust + at)};
  }
};

// The separations of a pack of candidates, unscaled.
template <ContactKind kind>
LAZYCCD_INLINE DoubleLanes separations(const LeafScene& scene, const Candidate* c) {
  alignas(64) double h[DoubleLanes::lanes];
  for (int i = 0; i < DoubleLanes::lanes; ++i) h[i] = scene.separation.of<kind>(scene.mesh, c[i]);
  return DoubleLanes::load(h);
}

// The culling tests of core/narrow/separation.h, with the unscaled separations h. A backend may
// have culled the same pairs with wider margins.
template <ContactKind kind>
LAZYCCD_INLINE WideMask culled(const LeafScene& scene, const CoordinatesOf<DoubleLanes>& q,
                               const Differences<DoubleLanes>& d, const Magnitudes<DoubleLanes>& m,
                               const DoubleLanes& h) {
  return separated_along_axes<kind>(q, h) | separated_along_diagonals<kind>(q, h) |
         planes_apart(d, m, DoubleLanes(scene.scale) * h);
}

// Searches in rounds of a few advances. Between rounds, the lanes of searches that have ended are
// filled with others.
template <ContactKind kind>
int within_kind(const LeafScene& scene, Approach* found, int count) {
  constexpr int round = 4;      // advances
  constexpr double missed = 2;  // marks an approach that is no hit
  Searches searches(count);
  for (int advances = 0; searches.count > 0 && advances < kMaxAdvances; advances += round) {
    int remaining = 0;
    for (int begin = 0; begin < searches.count; begin += DoubleLanes::lanes) {
      const Batch batch(begin, searches.count, [&](int i) { return found[searches.of[i]]; });
      const CoordinatesOf<DoubleLanes> q = gather<kind>(scene, batch.pair);
      const Differences<DoubleLanes> d = differences<kind>(q, scene.scale);
      const Magnitudes<DoubleLanes> m = magnitudes(d);
      const DoubleLanes unscaled = separations<kind>(scene, batch.pair),
                        h = DoubleLanes(scene.scale) * unscaled;
      Search<DoubleLanes> search = searches.load(begin);
      const WideMask used = batch.used();
      WideMask misses = advances == 0 ? culled<kind>(scene, q, d, m, unscaled) : used & !used;
      WideMask going = used & !misses;
      for (int i = 0; i < round && lane_any(going); ++i) {
        Search<DoubleLanes> next = search;
        const Advanced<DoubleLanes> advanced = advance<kind>(d, m, h, next);
        misses = misses | (going & advanced.missed);
        going = going & !advanced.missed & !advanced.arrived;
        search.t = select(going, next.t, search.t);
        search.ahead = select(going, next.ahead, search.ahead);
        search.trust = select(going, next.trust, search.trust);
      }
      alignas(64) double t[DoubleLanes::lanes], ahead[DoubleLanes::lanes],
          trust[DoubleLanes::lanes];
      select(misses, DoubleLanes(missed), search.t).store(t);
      search.ahead.store(ahead);
      search.trust.store(trust);
      const unsigned continues = going.bits();
      for (int i = 0; i < batch.count; ++i) {
        const std::int16_t at = searches.of[begin + i];
        found[at].t = t[i];
        searches.of[remaining] = at;
        searches.t[remaining] = t[i];
        searches.ahead[remaining] = ahead[i];
        searches.trust[remaining] = trust[i];
        remaining += static_cast<int>(continues >> i & 1);
      }
    }
    searches.count = remaining;
  }

  int hits = 0;
  for (int i = 0; i < count; ++i)
    if (found[i].t != missed) found[hits++] = found[i];
  return hits;
}

template <ContactKind kind>
void describe_kind(const LeafScene& scene, const Approach* approaches, int count,
                   ContactPlace* places) {
  for (int begin = 0; begin < count; begin += DoubleLanes::lanes) {
    const Batch batch(begin, count, [&](int i) { return approaches[i]; });
    alignas(64) double toi[DoubleLanes::lanes] = {};
    for (int i = 0; i < batch.count; ++i)
      toi[i] = static_cast<double>(approach_tick(approaches[begin + i].t)) * kTick;
    const Differences<DoubleLanes> d = differences<kind>(gather<kind>(scene, batch.pair), 1.0);
    const ContactPoint<DoubleLanes> point =
        contact_point<kind>(in_unit_scale(d), DoubleLanes::load(toi), true);
    const DoubleLanes values[] = {point.u, point.v, point.normal.x, point.normal.y, point.normal.z};
    alignas(64) double lanes[5][DoubleLanes::lanes];
    for (int k = 0; k < 5; ++k) values[k].store(lanes[k]);
    for (int i = 0; i < batch.count; ++i) {
      const auto value = [&](int k) { return static_cast<float>(lanes[k][i]); };
      places[begin + i] = {value(0), value(1), {value(2), value(3), value(4)}};
    }
  }
}

}  // namespace

void describe(const LeafScene& scene, ContactKind kind, const Approach* approaches, int count,
              ContactPlace* places) {
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
