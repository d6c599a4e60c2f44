#include "host/scene/kept_edges.h"

#include <algorithm>
#include <cstdint>
#include <type_traits>
#include <unordered_map>
#include <vector>

namespace lazyccd {
namespace {

struct Range {
  std::size_t first = 0, last = 0;
  std::size_t size() const { return last - first; }
};

// What belongs to a body.
struct BodyRanges {
  Range vertices, faces, more;
};

// Where the edges of a body are, or will be.
struct EdgeRanges {
  Range edges, free;
};

// Sets the range of each body in `items`. False if they are not in the order of their bodies.
template <class Item, class BodyOf>
bool find_ranges(Span<const Item> items, const BodyOf& body_of, Range BodyRanges::*range,
                 std::vector<BodyRanges>& bodies) {
  std::int32_t last = -1;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::int32_t body = body_of(items[i]);
    if (body < last) return false;
    Range& of_body = bodies[static_cast<std::size_t>(body)].*range;
    if (body > last) of_body.first = i;
    of_body.last = i + 1;
    last = body;
  }
  return true;
}

bool find_bodies(const EdgeInput& input, std::vector<BodyRanges>& bodies) {
  bodies.assign(input.body_count, {});
  const auto of_vertex = [&](std::int32_t v) {
    return input.body_of_vertex[static_cast<std::size_t>(v)];
  };
  const auto of_first = [&](const auto& primitive) { return of_vertex(primitive[0]); };
  return find_ranges(
             input.body_of_vertex, [](std::int32_t body) { return body; }, &BodyRanges::vertices,
             bodies) &&
         find_ranges(input.faces, of_first, &BodyRanges::faces, bodies) &&
         find_ranges(input.more, of_first, &BodyRanges::more, bodies);
}

// Whether two lists of primitives are equal but for the first vertex of their bodies.
template <class Primitive>
bool are_equal(Span<const Primitive> a, const Range& of_a, std::size_t first_a,
               Span<const Primitive> b, const Range& of_b, std::size_t first_b) {
  const auto shift = static_cast<std::int32_t>(first_a) - static_cast<std::int32_t>(first_b);
  return of_a.size() == of_b.size() &&
         std::equal(a.begin() + of_a.first, a.begin() + of_a.last, b.begin() + of_b.first,
                    [shift](const Primitive& x, const Primitive& y) {
                      for (std::size_t k = 0; k < x.size(); ++k)
                        if (x[k] != y[k] + shift) return false;
                      return true;
                    });
}

bool are_equal(const EdgeInput& a, const BodyRanges& of_a, const EdgeInput& b,
               const BodyRanges& of_b) {
  const std::size_t count = of_a.vertices.size();
  if (count != of_b.vertices.size()) return false;
  const auto pinned = [](const EdgeInput& input, std::size_t vertex) {
    return !input.pinned.empty() && input.pinned[vertex] != 0;
  };
  for (std::size_t i = 0; i < count; ++i)
    if (pinned(a, of_a.vertices.first + i) != pinned(b, of_b.vertices.first + i)) return false;
  return are_equal(a.faces, of_a.faces, of_a.vertices.first, b.faces, of_b.faces,
                   of_b.vertices.first) &&
         are_equal(a.more, of_a.more, of_a.vertices.first, b.more, of_b.more, of_b.vertices.first);
}

// A hash of what are_equal() compares, without what is pinned.
std::uint64_t content_hash(const EdgeInput& input, const BodyRanges& body) {
  std::uint64_t hash = body.vertices.size();
  const auto add = [&](const auto& primitives, const Range& range) {
    hash = (hash ^ range.size()) * 0x9e3779b97f4a7c15;
    for (std::size_t i = range.first; i < range.last; ++i)
      for (const std::int32_t v : primitives[i])
        hash = (hash ^ (static_cast<std::size_t>(v) - body.vertices.first)) * 0x9e3779b97f4a7c15;
  };
  add(input.faces, body.faces);
  add(input.more, body.more);
  return hash ^ hash >> 32;
}

class KeptEdgeBuilder {
 public:
  KeptEdgeBuilder(const EdgeInput& input, const EdgeInput& last_input, const EdgeTable& last,
                  EdgeTable& table, ThreadPool& pool)
      : input_(input), last_input_(last_input), last_(last), table_(table), pool_(pool) {}

  bool run() {
    if (!find_bodies(last_input_, last_bodies_) || !find_bodies(input_, bodies_)) return false;
    find_kept();
    std::size_t new_faces = 0;
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      if (kept_[b] < 0) new_faces += bodies_[b].faces.size() + bodies_[b].more.size();
    if (2 * new_faces > input_.faces.size() + input_.more.size()) return false;
    find_new();
    find_places();
    pool_.parallel_for(bodies_.size(), 1, [&](std::size_t first, std::size_t last, int) {
      for (std::size_t b = first; b < last; ++b) write(b);
    });
    return true;
  }

 private:
  // Finds a body of the last topology that is equal, for each body, or -1. Most have the same
  // order.
  void find_kept() {
    kept_.assign(bodies_.size(), -1);
    std::size_t next = 0;
    const auto is_kept_by = [&](std::size_t b, std::size_t last) {
      if (last >= last_bodies_.size() ||
          !are_equal(input_, bodies_[b], last_input_, last_bodies_[last]))
        return false;
      kept_[b] = static_cast<std::int32_t>(last);
      next = last + 1;
      return true;
    };
    std::unordered_map<std::uint64_t, std::size_t> by_content;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (is_kept_by(b, next)) continue;
      if (by_content.empty())
        for (std::size_t k = 0; k < last_bodies_.size(); ++k)
          by_content.emplace(content_hash(last_input_, last_bodies_[k]), k);
      const auto found = by_content.find(content_hash(input_, bodies_[b]));
      if (found != by_content.end()) is_kept_by(b, found->second);
    }
  }

  // Finds the edges of the bodies that are new, with their own numbers of vertices and faces.
  void find_new() {
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (kept_[b] >= 0) continue;
      const BodyRanges& body = bodies_[b];
      const auto own = [&](const auto& all, const Range& range) {
        std::vector<std::decay_t<decltype(all[0])>> primitives(all.begin() + range.first,
                                                               all.begin() + range.last);
        for (auto& primitive : primitives)
          for (std::int32_t& v : primitive) v -= static_cast<std::int32_t>(body.vertices.first);
        return primitives;
      };
      const std::vector<Face> faces = own(input_.faces, body.faces);
      const std::vector<Edge> more = own(input_.more, body.more);
      const Span<const char> pinned =
          input_.pinned.empty()
              ? Span<const char>()
              : Span<const char>(input_.pinned.data() + body.vertices.first, body.vertices.size());
      new_tables_.emplace_back().build(body.vertices.size(), faces, more, pinned, pool_);
      has_duplicates_ = has_duplicates_ || new_tables_.back().has_duplicate_faces;
    }
  }

  void find_places() {
    places_.resize(bodies_.size());
    sources_.resize(bodies_.size());
    new_table_of_.assign(bodies_.size(), nullptr);
    std::size_t edges = 0, free = 0, found = 0;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      if (kept_[b] >= 0) {
        sources_[b] = last_ranges(last_bodies_[static_cast<std::size_t>(kept_[b])].vertices);
      } else {
        new_table_of_[b] = &new_tables_[found++];
        sources_[b] = {{0, new_table_of_[b]->edges.size()},
                       {0, new_table_of_[b]->free_edges.size()}};
      }
      places_[b] = {{edges, edges + sources_[b].edges.size()},
                    {free, free + sources_[b].free.size()}};
      edges = places_[b].edges.last;
      free = places_[b].free.last;
    }
    table_.edges.resize(edges);
    table_.first_faces.resize(edges);
    table_.free_edges.resize(free);
    table_.face_edges.resize(input_.faces.size());
    table_.has_duplicate_faces = has_duplicates_;
  }

  // Edges are sorted by their larger vertex, so those of a body are together.
  EdgeRanges last_ranges(const Range& vertices) const {
    const auto edge_at = [this](std::size_t vertex) {
      return static_cast<std::size_t>(
          std::lower_bound(last_.edges.begin(), last_.edges.end(), vertex,
                           [](const Edge& edge, std::size_t v) {
                             return static_cast<std::size_t>(edge[1]) < v;
                           }) -
          last_.edges.begin());
    };
    const auto free_at = [this](std::size_t edge) {
      return static_cast<std::size_t>(
          std::lower_bound(
              last_.free_edges.begin(), last_.free_edges.end(), edge,
              [](std::int32_t e, std::size_t i) { return static_cast<std::size_t>(e) < i; }) -
          last_.free_edges.begin());
    };
    const Range edges = {edge_at(vertices.first), edge_at(vertices.last)};
    return {edges, {free_at(edges.first), free_at(edges.last)}};
  }

  // Copies what belongs to a body, and shifts the numbers.
  void write(std::size_t b) {
    const bool is_new = new_table_of_[b] != nullptr;
    const EdgeTable& from = is_new ? *new_table_of_[b] : last_;
    const BodyRanges source = is_new ? BodyRanges{{}, {0, bodies_[b].faces.size()}, {}}
                                     : last_bodies_[static_cast<std::size_t>(kept_[b])];
    const auto difference = [](std::size_t to, std::size_t of) {
      return static_cast<std::int32_t>(to) - static_cast<std::int32_t>(of);
    };
    const std::int32_t vertex = difference(bodies_[b].vertices.first, source.vertices.first),
                       face = difference(bodies_[b].faces.first, source.faces.first),
                       edge = difference(places_[b].edges.first, sources_[b].edges.first);
    for (std::size_t i = 0; i < places_[b].edges.size(); ++i) {
      const Edge& e = from.edges[sources_[b].edges.first + i];
      table_.edges[places_[b].edges.first + i] = {e[0] + vertex, e[1] + vertex};
      const std::int32_t f = from.first_faces[sources_[b].edges.first + i];
      table_.first_faces[places_[b].edges.first + i] = f < 0 ? f : f + face;
    }
    for (std::size_t i = 0; i < places_[b].free.size(); ++i)
      table_.free_edges[places_[b].free.first + i] =
          from.free_edges[sources_[b].free.first + i] + edge;
    for (std::size_t i = 0; i < bodies_[b].faces.size(); ++i) {
      const auto& sides = from.face_edges[source.faces.first + i];
      table_.face_edges[bodies_[b].faces.first + i] = {sides[0] + edge, sides[1] + edge,
                                                       sides[2] + edge};
    }
  }

  const EdgeInput &input_, &last_input_;
  const EdgeTable& last_;
  EdgeTable& table_;
  ThreadPool& pool_;
  std::vector<BodyRanges> bodies_, last_bodies_;
  std::vector<std::int32_t> kept_;
  std::vector<EdgeTable> new_tables_;
  std::vector<const EdgeTable*> new_table_of_;  // by body; null: kept
  std::vector<EdgeRanges> places_, sources_;    // by body
  bool has_duplicates_ = false;
};

}  // namespace

bool build_with_kept_edges(const EdgeInput& input, const EdgeInput& last_input,
                           const EdgeTable& last, EdgeTable& table, ThreadPool& pool) {
  return KeptEdgeBuilder(input, last_input, last, table, pool).run();
}

}  // namespace lazyccd
