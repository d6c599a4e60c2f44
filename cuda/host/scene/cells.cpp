#include "host/scene/cells.h"

#include <numeric>

namespace lazyccd {
namespace {

constexpr std::size_t kFaceGrain = 1 << 15;

}  // namespace

void Cells::build(Span<const Face> faces, Span<const Edge> edges,
                  Span<const std::int32_t> free_edges, Span<const std::int32_t> body_of_vertex,
                  std::size_t body_count, Span<const std::int32_t> world_of_body,
                  ThreadPool& pool) {
  primitives_.resize(faces.size() + free_edges.size());
  segments_.clear();
  std::int32_t groups = 0;
  const auto add = [&](std::size_t body, bool has_faces, std::size_t first, std::size_t count) {
    if (count == 0) return;
    const auto as_int = [](std::size_t i) { return static_cast<std::int32_t>(i); };
    segments_.push_back({as_int(body), has_faces, as_int(first), as_int(count), groups});
    groups += segments_.back().groups();
  };

  if (body_count == 1) {  // the common case needs no sort
    pool.parallel_for(faces.size(), kFaceGrain, [&](std::size_t first, std::size_t last, int) {
      for (std::size_t f = first; f < last; ++f) primitives_[f] = static_cast<std::int32_t>(f);
    });
    std::copy(free_edges.begin(), free_edges.end(), primitives_.begin() + faces.size());
    add(0, true, 0, faces.size());
    add(0, false, faces.size(), free_edges.size());
    return;
  }
  // A counting sort. Two bins per body: its faces, its free edges.
  const auto face_bin = [&](std::size_t f) {
    return 2 * static_cast<std::size_t>(body_of_vertex[faces[f][0]]);
  };
  const auto edge_bin = [&](std::int32_t e) {
    return 2 * static_cast<std::size_t>(body_of_vertex[edges[e][0]]) + 1;
  };
  std::vector<std::size_t> place(2 * body_count, 0);  // first how many, then where
  for (std::size_t f = 0; f < faces.size(); ++f) ++place[face_bin(f)];
  for (const std::int32_t e : free_edges) ++place[edge_bin(e)];
  std::vector<std::size_t> bodies(body_count);
  std::iota(bodies.begin(), bodies.end(), std::size_t{0});
  if (!world_of_body.empty())
    std::stable_sort(bodies.begin(), bodies.end(), [&](std::size_t a, std::size_t b) {
      return world_of_body[a] < world_of_body[b];
    });
  std::size_t first = 0;
  for (const std::size_t body : bodies)
    for (const std::size_t bin : {2 * body, 2 * body + 1}) {
      const std::size_t count = place[bin];
      add(body, bin % 2 == 0, first, count);
      place[bin] = first;
      first += count;
    }
  for (std::size_t f = 0; f < faces.size(); ++f)
    primitives_[place[face_bin(f)]++] = static_cast<std::int32_t>(f);
  for (const std::int32_t e : free_edges) primitives_[place[edge_bin(e)]++] = e;
}

}  // namespace lazyccd
