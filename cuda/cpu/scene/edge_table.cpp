#include "cpu/scene/edge_table.h"

#include <algorithm>
#include <atomic>
#include <utility>
#include <vector>

#include "cpu/threads/shared_array.h"

namespace lazyccd {
namespace {

constexpr std::size_t kGrain = 1 << 12;     // faces that a thread takes at a time
constexpr std::size_t kVertices = 1 << 11;  // vertices that a thread takes at a time

// A side of a face, or an edge of its own, in the list of its larger vertex: the smaller vertex in
// the upper half. In the lower half 3 * face + side, or a number beyond those.
using Side = std::uint64_t;
std::uint32_t smaller_vertex(Side side) { return static_cast<std::uint32_t>(side >> 32); }
std::uint32_t number(Side side) { return static_cast<std::uint32_t>(side); }

// Finds the edges in five passes over faces or vertices: count the sides at each larger vertex; put
// them there; sort each list and count its edges; number the edges; write them.
class Builder {
 public:
  Builder(EdgeTable& table, std::size_t vertex_count, Span<const Face> faces, Span<const Edge> more,
          Span<const char> pinned, ThreadPool& pool)
      : table_(table),
        faces_(faces),
        more_(more),
        pinned_(pinned),
        pool_(pool),
        vertex_count_(vertex_count),
        sides_(3 * faces.size() + more.size()),
        totals_((vertex_count + kVertices - 1) / kVertices) {}

  void run() {
    end_.assign(vertex_count_, 0, pool_);
    for_each_side([&](std::int32_t, std::int32_t larger, std::size_t) {
      end_.increment(static_cast<std::size_t>(larger));
    });
    turn_counts_into_starts();
    for_each_side([&](std::int32_t smaller, std::int32_t larger, std::size_t n) {
      sides_[end_.increment(static_cast<std::size_t>(larger))] =
          static_cast<Side>(static_cast<std::uint32_t>(smaller)) << 32 | n;
    });
    for_each_part([&](std::size_t part, std::size_t first, std::size_t last) {
      totals_[part] = sort_and_count(first, last);
    });
    Totals all;
    for (Totals& part : totals_) {
      all.edges += std::exchange(part.edges, all.edges);
      all.free += std::exchange(part.free, all.free);
    }
    table_.edges.resize(all.edges);
    table_.first_faces.resize(all.edges);
    table_.free_edges.resize(all.free);
    table_.face_edges.resize(faces_.size());
    for_each_part([&](std::size_t part, std::size_t first, std::size_t last) {
      write(first, last, totals_[part]);
    });
    table_.has_duplicate_faces = has_duplicates_.load(std::memory_order_relaxed);
  }

 private:
  struct Totals {
    std::size_t sides = 0, edges = 0, free = 0;
  };

  template <class F>
  void for_each_side(F&& f) {
    const auto call = [&](std::int32_t a, std::int32_t b, std::size_t n) {
      f(std::min(a, b), std::max(a, b), n);
    };
    pool_.parallel_for(faces_.size(), kGrain, [&](std::size_t first, std::size_t last, int) {
      for (std::size_t face = first; face < last; ++face)
        for (std::size_t i = 0; i < 3; ++i)
          call(faces_[face][i], faces_[face][(i + 1) % 3], 3 * face + i);
    });
    pool_.parallel_for(more_.size(), kGrain, [&](std::size_t first, std::size_t last, int) {
      for (std::size_t e = first; e < last; ++e)
        call(more_[e][0], more_[e][1], 3 * faces_.size() + e);
    });
  }

  // Calls body(part, first, last) for all parts of the vertices.
  template <class Body>
  void for_each_part(Body&& body) {
    pool_.parallel_for(totals_.size(), 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t p = begin; p < end; ++p)
        body(p, p * kVertices, std::min((p + 1) * kVertices, vertex_count_));
    });
  }

  void turn_counts_into_starts() {
    for_each_part([&](std::size_t part, std::size_t first, std::size_t last) {
      for (std::size_t v = first; v < last; ++v) totals_[part].sides += end_[v];
    });
    std::size_t sum = 0;
    for (Totals& part : totals_) sum += std::exchange(part.sides, sum);
    for_each_part([&](std::size_t part, std::size_t first, std::size_t last) {
      std::size_t at = totals_[part].sides;
      for (std::size_t v = first; v < last; ++v) {
        const std::uint32_t count = end_[v];
        end_.set(v, static_cast<std::uint32_t>(at));
        at += count;
      }
    });
  }

  // Calls f(vertex, first, last) for each edge whose larger vertex is in [first, last): its sides
  // are [first, last) of sides_.
  template <class F>
  void for_each_edge(std::size_t first_vertex, std::size_t last_vertex, F&& f) {
    std::size_t at = first_vertex == 0 ? 0 : end_[first_vertex - 1];
    for (std::size_t v = first_vertex; v < last_vertex; ++v)
      for (const std::size_t end = end_[v]; at < end;) {
        std::size_t last = at + 1;
        while (last < end && smaller_vertex(sides_[last]) == smaller_vertex(sides_[at])) ++last;
        f(v, at, last);
        at = last;
      }
  }

  bool is_of_face(std::size_t side) const { return number(sides_[side]) < 3 * faces_.size(); }

  Totals sort_and_count(std::size_t first, std::size_t last) {
    Totals totals;
    std::size_t at = first == 0 ? 0 : end_[first - 1];
    for (std::size_t v = first; v < last; ++v) {
      const std::size_t end = end_[v];
      std::sort(sides_.begin() + static_cast<std::ptrdiff_t>(at),
                sides_.begin() + static_cast<std::ptrdiff_t>(end));
      at = end;
    }
    for_each_edge(first, last, [&](std::size_t, std::size_t begin, std::size_t end) {
      ++totals.edges;
      totals.free += !is_of_face(begin);  // sides of faces come first
      if (end - begin > 1 && shares_two_faces(begin, end))
        has_duplicates_.store(true, std::memory_order_relaxed);
    });
    return totals;
  }

  // Whether two faces at an edge have the same third vertex.
  bool shares_two_faces(std::size_t first, std::size_t last) const {
    const auto third = [&](std::size_t side) {
      const std::uint32_t n = number(sides_[side]);
      return faces_[n / 3][(n + 2) % 3];
    };
    while (last > first && !is_of_face(last - 1)) --last;
    if (last - first < 2) return false;
    if (last - first == 2) return third(first) == third(first + 1);
    std::vector<std::int32_t> thirds;
    for (std::size_t i = first; i < last; ++i) thirds.push_back(third(i));
    std::sort(thirds.begin(), thirds.end());
    return std::adjacent_find(thirds.begin(), thirds.end()) != thirds.end();
  }

  bool is_pinned(const Face& face) const {
    return !pinned_.empty() && pinned_[static_cast<std::size_t>(face[0])] &&
           pinned_[static_cast<std::size_t>(face[1])] && pinned_[static_cast<std::size_t>(face[2])];
  }

  void write(std::size_t first, std::size_t last, Totals at) {
    for_each_edge(first, last, [&](std::size_t v, std::size_t begin, std::size_t end) {
      const auto id = static_cast<std::int32_t>(at.edges);
      table_.edges[at.edges] = {static_cast<std::int32_t>(smaller_vertex(sides_[begin])),
                                static_cast<std::int32_t>(v)};
      if (!is_of_face(begin)) table_.free_edges[at.free++] = id;
      std::int32_t first_face = -1;
      for (std::size_t i = begin; i < end && is_of_face(i); ++i) {
        const std::uint32_t n = number(sides_[i]);
        table_.face_edges[n / 3][n % 3] = id;
        if (first_face < 0 && !is_pinned(faces_[n / 3]))
          first_face = static_cast<std::int32_t>(n / 3);
      }
      table_.first_faces[at.edges++] = first_face;
    });
  }

  EdgeTable& table_;
  Span<const Face> faces_;
  Span<const Edge> more_;
  Span<const char> pinned_;
  ThreadPool& pool_;
  std::size_t vertex_count_;
  SharedArray end_;  // by vertex: the end of its list so far
  NoinitVector<Side> sides_;
  std::vector<Totals> totals_;  // by part of the vertices; then the sums before it
  std::atomic<bool> has_duplicates_{false};
};

}  // namespace

void EdgeTable::build(std::size_t vertex_count, Span<const Face> faces, Span<const Edge> more,
                      Span<const char> pinned, ThreadPool& pool) {
  Builder(*this, vertex_count, faces, more, pinned, pool).run();
}

}  // namespace lazyccd
