#include "host/scene/edge_table.h"

#include <algorithm>
#include <atomic>
#include <utility>
#include <vector>

namespace lazyccd {
namespace {

constexpr std::size_t kItems = 1 << 12;  // fewest faces that a thread takes at a time
constexpr int kPartBits = 10;
constexpr std::size_t kVertices = std::size_t{1} << kPartBits;  // of a part: its lists fit in cache

// A side of a face, or an edge of its own. The number is 3 * face + side, or one beyond those.
struct Side {
  std::int32_t larger, smaller;  // its vertices
  std::uint32_t number;
};

// A side in the list of its larger vertex: the smaller vertex, then the number.
using ListedSide = std::uint64_t;
std::uint32_t smaller_vertex(ListedSide side) { return static_cast<std::uint32_t>(side >> 32); }
std::uint32_t number(ListedSide side) { return static_cast<std::uint32_t>(side); }

// Finds the edges in passes that share nothing between threads: distribute the sides to parts of
// the vertices, by the larger vertex; in each part make a sorted list for each vertex, and count
// the edges; number the edges; write them.
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
        end_(vertex_count),
        sides_(3 * faces.size() + more.size()),
        parts_((vertex_count + kVertices - 1) / kVertices) {}

  void run() {
    const NoinitVector<Side> sides = distribute();
    for_each_part([&](Part& part, std::size_t first, std::size_t last) {
      make_lists(sides, part, first, last);
      count_edges(part, first, last);
    });
    std::size_t edges = 0, free = 0;
    for (Part& part : parts_) {
      edges += std::exchange(part.edges, edges);
      free += std::exchange(part.free, free);
    }
    table_.edges.resize(edges);
    table_.first_faces.resize(edges);
    table_.free_edges.resize(free);
    table_.face_edges.resize(faces_.size());
    for_each_part(
        [&](const Part& part, std::size_t first, std::size_t last) { write(part, first, last); });
    table_.has_duplicate_faces = has_duplicates_.load(std::memory_order_relaxed);
  }

 private:
  // Consecutive vertices: their first side, and the end; their numbers of edges and of free edges,
  // then the sums over the parts before.
  struct Part {
    std::size_t first_side = 0, last_side = 0, edges = 0, free = 0;
  };

  // Calls f(larger, smaller, number) for the sides of the items [first, last): faces, then edges.
  template <class F>
  void for_each_side(std::size_t first, std::size_t last, F&& f) const {
    const auto call = [&](std::int32_t a, std::int32_t b, std::size_t n) {
      f(std::max(a, b), std::min(a, b), static_cast<std::uint32_t>(n));
    };
    for (std::size_t i = first; i < std::min(last, faces_.size()); ++i)
      for (std::size_t k = 0; k < 3; ++k) call(faces_[i][k], faces_[i][(k + 1) % 3], 3 * i + k);
    for (std::size_t i = std::max(first, faces_.size()); i < last; ++i) {
      const std::size_t e = i - faces_.size();
      call(more_[e][0], more_[e][1], 3 * faces_.size() + e);
    }
  }

  // Returns the sides in the order of the parts, and sets where the parts begin and end.
  NoinitVector<Side> distribute() {
    const std::size_t items = faces_.size() + more_.size(), part_count = parts_.size();
    const std::size_t threads = static_cast<std::size_t>(pool_.available());
    const std::size_t chunks = threads == 1 ? 1 : std::min(items / kItems + 1, 2 * threads);
    const std::size_t length = (items + chunks - 1) / chunks;
    NoinitVector<Side> sides(sides_.size());
    NoinitVector<std::size_t> places(chunks * part_count);
    const auto for_each_chunk = [&](auto&& f) {
      pool_.parallel_for(chunks, 1, [&](std::size_t begin, std::size_t end, int) {
        for (std::size_t c = begin; c < end; ++c)
          for_each_side(std::min(c * length, items), std::min((c + 1) * length, items),
                        [&, place = places.data() + c * part_count](
                            std::int32_t larger, std::int32_t smaller, std::uint32_t n) {
                          f(place[larger >> kPartBits], Side{larger, smaller, n});
                        });
      });
    };
    std::fill(places.begin(), places.end(), std::size_t{0});
    for_each_chunk([](std::size_t& count, const Side&) { ++count; });
    std::size_t sum = 0;
    for (std::size_t p = 0; p < part_count; ++p) {
      parts_[p].first_side = sum;
      for (std::size_t c = 0; c < chunks; ++c)
        sum += std::exchange(places[c * part_count + p], sum);
      parts_[p].last_side = sum;
    }
    for_each_chunk([&](std::size_t& place, const Side& side) { sides[place++] = side; });
    return sides;
  }

  // Calls body(part, first, last) for all parts and the vertices [first, last) of each.
  template <class Body>
  void for_each_part(Body&& body) {
    pool_.parallel_for(parts_.size(), 1, [&](std::size_t begin, std::size_t end, int) {
      for (std::size_t p = begin; p < end; ++p)
        body(parts_[p], p * kVertices, std::min((p + 1) * kVertices, vertex_count_));
    });
  }

  // Makes the sorted lists of the vertices of a part.
  void make_lists(const NoinitVector<Side>& sides, const Part& part, std::size_t first,
                  std::size_t last) {
    std::uint32_t* const end = end_.data();
    std::fill(end + first, end + last, 0u);
    for (std::size_t i = part.first_side; i < part.last_side; ++i) ++end[sides[i].larger];
    auto sum = static_cast<std::uint32_t>(part.first_side);
    for (std::size_t v = first; v < last; ++v) sum += std::exchange(end[v], sum);
    for (std::size_t i = part.first_side; i < part.last_side; ++i)
      sides_[end[sides[i].larger]++] =
          static_cast<ListedSide>(static_cast<std::uint32_t>(sides[i].smaller)) << 32 |
          sides[i].number;
    std::size_t at = part.first_side;
    for (std::size_t v = first; v < last; ++v) {
      std::sort(sides_.data() + at, sides_.data() + end[v]);
      at = end[v];
    }
  }

  // Calls f(vertex, first, last) for each edge whose larger vertex is in [first, last): its sides
  // are [first, last) of sides_.
  template <class F>
  void for_each_edge(const Part& part, std::size_t first_vertex, std::size_t last_vertex,
                     F&& f) const {
    std::size_t at = part.first_side;
    for (std::size_t v = first_vertex; v < last_vertex; ++v)
      for (const std::size_t end = end_[v]; at < end;) {
        std::size_t last = at + 1;
        while (last < end && smaller_vertex(sides_[last]) == smaller_vertex(sides_[at])) ++last;
        f(v, at, last);
        at = last;
      }
  }

  bool is_of_face(std::size_t side) const { return number(sides_[side]) < 3 * faces_.size(); }

  void count_edges(Part& part, std::size_t first, std::size_t last) {
    part.edges = part.free = 0;
    for_each_edge(part, first, last, [&](std::size_t, std::size_t begin, std::size_t end) {
      ++part.edges;
      part.free += !is_of_face(begin);  // sides of faces come first
      if (end - begin > 1 && shares_two_faces(begin, end))
        has_duplicates_.store(true, std::memory_order_relaxed);
    });
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

  void write(Part at, std::size_t first, std::size_t last) {
    for_each_edge(at, first, last, [&](std::size_t v, std::size_t begin, std::size_t end) {
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
  NoinitVector<std::uint32_t> end_;  // by vertex: the end of its list in sides_
  NoinitVector<ListedSide> sides_;
  std::vector<Part> parts_;
  std::atomic<bool> has_duplicates_{false};
};

}  // namespace

void EdgeTable::build(std::size_t vertex_count, Span<const Face> faces, Span<const Edge> more,
                      Span<const char> pinned, ThreadPool& pool) {
  Builder(*this, vertex_count, faces, more, pinned, pool).run();
}

}  // namespace lazyccd
