#include "host/scene/positions.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <string>

#include "lazyccd/error.h"

namespace lazyccd {

void check_counts(const Mesh& mesh, const Positions& start, const Positions& end) {
  const std::size_t count = mesh.vertex_count();
  if (start.count() != count || end.count() != count)
    throw Error(ErrorCode::size_mismatch, "the topology has " + std::to_string(count) +
                                              " vertices, the positions " +
                                              std::to_string(start.count()) + " at the start and " +
                                              std::to_string(end.count()) + " at the end");
}

void check_finite(const Mesh& mesh, const Positions& start, const Positions& end) {
  for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
    const std::array<double, 3> a = start[v], b = end[v];
    const auto finite = [](double x) { return std::isfinite(x); };
    if (std::all_of(a.begin(), a.end(), finite) && std::all_of(b.begin(), b.end(), finite))
      continue;
    const std::int32_t body = mesh.body_of_vertex()[v];
    throw Error(ErrorCode::non_finite_position,
                "vertex " + std::to_string(v) + " of body " + std::to_string(body) +
                    " has a position that is not finite",
                body, static_cast<std::int32_t>(v));
  }
}

double load_records(const Mesh& mesh, const Positions& start, const Positions& end,
                    ThreadPool& pool, std::vector<VertexRecord>& records) {
  check_counts(mesh, start, end);
  const std::size_t count = mesh.vertex_count();
  records.resize(count);
  struct Bounds {
    double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  };
  Bounds bounds;  // of all ranges
  std::mutex adding;
  // Relaxed: the end of the job orders the stores.
  std::atomic<bool> all_finite{true};
  pool.parallel_for(count, 4096, [&](std::size_t first, std::size_t last, int) {
    Bounds box;
    double zero = 0;  // stays zero if all positions are finite: NaN and infinity times 0 are NaN
    for (std::size_t v = first; v < last; ++v) {
      double* x = records[v].x;
      const std::array<double, 3> a = start[v], b = end[v];
      for (int k = 0; k < 3; ++k) {
        // Adding 0.0 removes negative zeros. With one at the start, signs of zeros in a normal at
        // the start would depend on the end.
        x[k] = a[k] + 0.0;
        x[3 + k] = b[k] + 0.0;
        zero += a[k] * 0 + b[k] * 0;
        box.lo[k] = std::min(box.lo[k], std::min(a[k], b[k]));
        box.hi[k] = std::max(box.hi[k], std::max(a[k], b[k]));
      }
      x[6] = x[7] = 0;
    }
    if (!(zero == 0)) all_finite.store(false, std::memory_order_relaxed);
    const std::lock_guard<std::mutex> lock(adding);
    for (int k = 0; k < 3; ++k) {
      bounds.lo[k] = std::min(bounds.lo[k], box.lo[k]);
      bounds.hi[k] = std::max(bounds.hi[k], box.hi[k]);
    }
  });
  if (!all_finite.load(std::memory_order_relaxed)) check_finite(mesh, start, end);
  double size = 0;
  for (int k = 0; k < 3; ++k) size = std::max(size, bounds.hi[k] - bounds.lo[k]);
  return size;
}

}  // namespace lazyccd
