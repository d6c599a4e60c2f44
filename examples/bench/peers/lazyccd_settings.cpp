#include "bench/peers/lazyccd_settings.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "bench/cpu_clock.h"
#include "core/narrow/contact_math.h"
#include "core/narrow/decision.h"
#include "cpu/narrow/exact.h"
#include "host/kernels/leaf_kernels.h"

namespace lazyccd::peers {
namespace {

QueryCoordinates coordinates(const QueryPoints& points) {
  QueryCoordinates q;
  for (int i = 0; i < 4; ++i) {
    q.start[i] = {points[i][0], points[i][1], points[i][2]};
    q.end[i] = {points[4 + i][0], points[4 + i][1], points[4 + i][2]};
  }
  return q;
}

// Returns the power of two by which the detector scales a scene. It brings the sides of the box
// around all points to at most 2^6.
double scale_of(Span<const QueryPoints> queries) {
  double size = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const QueryPoints& points : queries)
      for (const auto& p : points) {
        low = std::min(low, p[axis]);
        high = std::max(high, p[axis]);
      }
    size = std::max(size, high - low);
  }
  if (!(size > 0) || !std::isfinite(size)) return 1;
  return std::ldexp(1.0, std::clamp(5 - std::ilogb(size), -1020, 1000));
}

QueryResult finish(ContactKind kind, const QueryPoints& points, const Decision& decision) {
  if (decision.kind == Decision::undecided) return decide_exact(kind, points);
  return {decision.kind == Decision::hit, static_cast<double>(decision.tick) * kTick};
}

template <ContactKind kind>
QueryResult decide_double(const QueryPoints& points) {
  const QueryCoordinates q = coordinates(points);
  if (separated_along_axes<kind>(q)) return {};
  const Differences<double> d = differences<kind>(q, scale_of({&points, 1}));
  return finish(kind, points, decide_in_double<kind>(d));
}

// Queries in the layout of a detector's scene. Query i owns the vertices 4i to 4i+3, the face i,
// and the edges 2i and 2i+1.
struct alignas(64) Record {
  double x[8];  // start, end, unused
};

struct Scene {
  std::vector<Record> records;
  std::vector<std::array<std::int32_t, 3>> faces;
  std::vector<std::array<std::int32_t, 2>> edges;
  LeafScene leaf{};
  std::int64_t filtered_noncoplanar = 0;

  explicit Scene(Span<const QueryPoints> queries) {
    for (const QueryPoints& points : queries) {
      const auto v = static_cast<std::int32_t>(records.size());
      for (int i = 0; i < 4; ++i) {
        const auto &p = points[i], &q = points[4 + i];
        records.push_back({{p[0], p[1], p[2], q[0], q[1], q[2], 0, 0}});
      }
      faces.push_back({v + 1, v + 2, v + 3});
      edges.push_back({v, v + 1});
      edges.push_back({v + 2, v + 3});
    }
    leaf.records = records.data()->x;
    leaf.mesh.faces = reinterpret_cast<const std::int32_t(*)[3]>(faces.data());
    leaf.mesh.edges = reinterpret_cast<const std::int32_t(*)[2]>(edges.data());
    leaf.scale = scale_of(queries);
    leaf.filtered_noncoplanar = &filtered_noncoplanar;
  }
};

template <ContactKind kind>
double decide_lanes(Span<const QueryPoints> queries, Span<QueryResult> answers) {
  if (queries.empty()) return 0;
  Scene scene(queries);
  const LeafKernels& kernels = *best_leaf_kernels();
  std::vector<Candidate> candidates(queries.size());
  std::vector<Survivor> survivors(queries.size());
  constexpr bool vf = kind == ContactKind::vertex_face;

  const double before = bench::thread_nanoseconds();
  int count = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) {
    answers[i] = {};
    const auto n = static_cast<std::int32_t>(i);
    candidates[static_cast<std::size_t>(count++)] =
        vf ? Candidate{4 * n, n} : Candidate{2 * n, 2 * n + 1};
  }
  const int left = kernels.filter(scene.leaf, kind, candidates.data(), count, survivors.data());
  for (int s = 0; s < left; ++s) {
    const Survivor& survivor = survivors[static_cast<std::size_t>(s)];
    const auto i = static_cast<std::size_t>(survivor.pair.a / (vf ? 4 : 2));
    const Differences<double> d = differences<kind>(coordinates(queries[i]), scene.leaf.scale);
    const Decision decision =
        survivor.hit ? timed_hit(coplanarity(d, magnitudes(d)), survivor.lo, survivor.hi)
                     : decide_in_double<kind>(d);
    answers[i] = finish(kind, queries[i], decision);
  }
  return bench::thread_nanoseconds() - before;
}

}  // namespace

QueryResult decide_double_only(ContactKind kind, const QueryPoints& points) {
  return kind == ContactKind::vertex_face ? decide_double<ContactKind::vertex_face>(points)
                                          : decide_double<ContactKind::edge_edge>(points);
}

double decide_in_lanes(ContactKind kind, Span<const QueryPoints> queries,
                       Span<QueryResult> answers) {
  return kind == ContactKind::vertex_face ? decide_lanes<ContactKind::vertex_face>(queries, answers)
                                          : decide_lanes<ContactKind::edge_edge>(queries, answers);
}

}  // namespace lazyccd::peers
