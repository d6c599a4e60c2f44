#include "host/scene/mesh.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <string>
#include <utility>

#include "host/threads/shared_array.h"
#include "lazyccd/error.h"

namespace lazyccd {
namespace {

constexpr std::size_t kGrain = 1 << 14;  // vertices or faces that a thread takes at a time

std::uint64_t pair_key(std::int32_t a, std::int32_t b) {
  const std::uint64_t lo = static_cast<std::uint32_t>(std::min(a, b));
  return lo << 32 | static_cast<std::uint32_t>(std::max(a, b));
}

// The memory of an array, empty, for one of another size.
template <class T>
NoinitVector<T> reuse(NoinitVector<T>& array, std::size_t size) {
  array.clear();  // nothing is copied if it grows
  return array.capacity() / 4 > size ? NoinitVector<T>() : std::move(array);
}

// Returns whether a face or edge has different vertices of one body.
template <std::size_t N>
bool is_valid(const std::array<std::int32_t, N>& v, Span<const std::int32_t> body_of_vertex) {
  for (std::size_t a = 0; a < N; ++a) {
    if (v[a] < 0 || static_cast<std::size_t>(v[a]) >= body_of_vertex.size()) return false;
    if (v[a] == v[(a + 1) % N] || body_of_vertex[v[a]] != body_of_vertex[v[0]]) return false;
  }
  return true;
}

template <std::size_t N>
bool are_valid(Span<const std::array<std::int32_t, N>> items,
               Span<const std::int32_t> body_of_vertex, ThreadPool& pool) {
  std::atomic<bool> valid{true};  // relaxed: the end of the job orders the stores
  pool.parallel_for(items.size(), kGrain, [&](std::size_t first, std::size_t last, int) {
    bool all = true;
    for (std::size_t i = first; i < last; ++i) all &= is_valid(items[i], body_of_vertex);
    if (!all) valid.store(false, std::memory_order_relaxed);
  });
  return valid.load(std::memory_order_relaxed);
}

// Throws if a face or edge is invalid, and says why; `what` is "face" or "edge".
template <std::size_t N>
void check_indices(const std::array<std::int32_t, N>& v, const char* what, std::size_t index,
                   Span<const std::int32_t> body_of_vertex) {
  const auto where = std::string(what) + " " + std::to_string(index);
  const auto id = static_cast<std::int32_t>(index);
  const auto count = static_cast<std::int64_t>(body_of_vertex.size());
  std::int32_t body = -1;
  for (const std::int32_t i : v)
    if (i >= 0 && i < count && body < 0) body = body_of_vertex[i];
  const auto of_body = body < 0 ? std::string() : " of body " + std::to_string(body);
  for (const std::int32_t i : v)
    if (i < 0 || i >= count)
      throw Error(ErrorCode::index_out_of_range,
                  where + of_body + ": vertex " + std::to_string(i) + " is outside [0, " +
                      std::to_string(count) + ")",
                  body, id);
  for (std::size_t a = 0; a < N; ++a) {
    for (std::size_t b = a + 1; b < N; ++b)
      if (v[a] == v[b])
        throw Error(ErrorCode::degenerate_face,
                    where + of_body + " names vertex " + std::to_string(v[a]) + " twice", body, id);
    if (body_of_vertex[v[a]] != body)
      throw Error(ErrorCode::mixed_body,
                  where + " joins vertices of bodies " + std::to_string(body) + " and " +
                      std::to_string(body_of_vertex[v[a]]),
                  body, id);
  }
}

}  // namespace

Mesh::Mesh(const Topology& topology, ThreadPool& pool, TopologyFinder* finder, const Mesh* last,
           MeshMemory memory)
    : faces_(reuse(memory.faces, topology.faces.size())),
      body_of_vertex_(reuse(memory.body_of_vertex, topology.vertex_count)) {
  take_bodies(topology, pool);
  is_complete_ = false;
  if (finder != nullptr) take_edges(topology, *finder);
  take_faces(topology, pool, finder == nullptr);
  if (finder == nullptr) {
    complete(pool, last);
    if (edges_.has_duplicate_faces) check_primitives(topology);
  }
  check_primitives_of_bodies();
}

EdgeInput Mesh::edge_input() const {
  return {body_of_vertex(), body_count(), faces(), more_edges_, pinned_};
}

bool Mesh::take_edges_of(const Mesh* last, ThreadPool& pool) const {
  return last != nullptr && last->is_complete_ &&
         build_with_kept_edges(edge_input(), last->edge_input(), last->edges_, edges_, pool);
}

void Mesh::complete(ThreadPool& pool, const Mesh* last) const {
  if (is_complete_) return;
  if (!take_edges_of(last, pool)) edges_.build(vertex_count(), faces(), more_edges_, pinned_, pool);
  edge_count_ = edges_.edges.size();
  find_first_faces(pool);
  cells_.build(faces(), edges(), free_edges(), body_of_vertex(), body_count(), world_of_body(),
               pool);
  is_complete_ = true;
}

Mesh::Mesh(const Topology& topology) {
  ThreadPool alone(1);
  *this = Mesh(topology, alone);
}

void Mesh::take_bodies(const Topology& t, ThreadPool& pool) {
  const auto fits = [&](std::size_t size) { return size == 0 || size == t.vertex_count; };
  if (!fits(t.body_of_vertex.size()) || !fits(t.inverse_mass.size()) ||
      !fits(t.self_separation.size()))
    throw Error(ErrorCode::size_mismatch,
                "body_of_vertex, inverse_mass and self_separation need an entry for each of the " +
                    std::to_string(t.vertex_count) + " vertices, or none");
  body_of_vertex_.resize(t.vertex_count);
  struct alignas(128) Range {  // of one worker, aligned against false sharing
    std::int32_t lo = 0, hi = -1;
  };
  std::vector<Range> ranges(static_cast<std::size_t>(pool.size()));
  pool.parallel_for(t.vertex_count, kGrain, [&](std::size_t first, std::size_t last, int worker) {
    Range range = ranges[worker];
    for (std::size_t v = first; v < last; ++v) {
      const std::int32_t body = t.body_of_vertex.empty() ? 0 : t.body_of_vertex[v];
      body_of_vertex_[v] = body;
      range = {std::min(range.lo, body), std::max(range.hi, body)};
    }
    ranges[worker] = range;
  });
  Range named;
  for (const Range& r : ranges) named = {std::min(named.lo, r.lo), std::max(named.hi, r.hi)};
  bodies_.assign(t.bodies.begin(), t.bodies.end());
  if (bodies_.empty()) bodies_.resize(static_cast<std::size_t>(named.hi + 1));
  const auto check_body = [&](std::int32_t body, const char* what, std::size_t index) {
    if (body < 0 || static_cast<std::size_t>(body) >= bodies_.size())
      throw Error(ErrorCode::index_out_of_range,
                  std::string(what) + " " + std::to_string(index) + ": body " +
                      std::to_string(body) + " is outside [0, " + std::to_string(bodies_.size()) +
                      ")",
                  body, static_cast<std::int32_t>(index));
  };
  if (named.lo < 0 || static_cast<std::size_t>(named.hi + 1) > bodies_.size())
    for (std::size_t v = 0; v < body_of_vertex_.size(); ++v)
      check_body(body_of_vertex_[v], "vertex", v);
  take_worlds();
  for (std::size_t i = 0; i < t.disabled_pairs.size(); ++i) {
    for (const std::int32_t body : t.disabled_pairs[i]) check_body(body, "disabled pair", i);
    disabled_.insert(pair_key(t.disabled_pairs[i][0], t.disabled_pairs[i][1]));
  }

  const auto refuse = [&](std::size_t v, const char* why) {
    throw Error(ErrorCode::invalid_argument,
                "vertex " + std::to_string(v) + " of body " + std::to_string(body_of_vertex_[v]) +
                    ": " + why,
                body_of_vertex_[v], static_cast<std::int32_t>(v));
  };
  for (std::size_t v = 0; v < t.inverse_mass.size(); ++v)
    if (!(t.inverse_mass[v] >= 0)) refuse(v, "its inverse mass is negative or not a number");
  for (std::size_t v = 0; v < t.self_separation.size(); ++v)
    if (!(t.self_separation[v] >= 0)) refuse(v, "its self_separation is negative or not a number");
  take_self_separation(t.self_separation);
  if (std::find(t.inverse_mass.begin(), t.inverse_mass.end(), 0.0f) != t.inverse_mass.end()) {
    pinned_.resize(t.vertex_count);
    for (std::size_t v = 0; v < t.vertex_count; ++v) pinned_[v] = t.inverse_mass[v] == 0.0f;
  }
}

void Mesh::take_self_separation(Span<const float> of_vertex) {
  self_separation_.assign(of_vertex.begin(), of_vertex.end());
  if (of_vertex.empty()) return;
  least_self_separation_.assign(bodies_.size(), std::numeric_limits<float>::infinity());
  for (std::size_t v = 0; v < of_vertex.size(); ++v) {
    const std::int32_t body = body_of_vertex_[v];
    float& least = least_self_separation_[body];
    if (bodies_[body].self_collision) least = std::min(least, of_vertex[v]);
  }
}

void Mesh::take_worlds() {
  bool differ = false;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const std::int32_t world = bodies_[b].world;
    if (world < -1 || world == std::numeric_limits<std::int32_t>::max())
      throw Error(ErrorCode::invalid_argument,
                  "body " + std::to_string(b) + ": world " + std::to_string(world) +
                      " is neither -1 nor the index of a world",
                  static_cast<std::int32_t>(b));
    world_count_ = std::max(world_count_, world + 1);
    differ = differ || world != bodies_[0].world;
  }
  if (!differ) return;
  for (const Body& body : bodies_) world_of_body_.push_back(body.world);
}

void Mesh::take_faces(const Topology& t, ThreadPool& pool, bool checks) {
  if (checks &&
      (!are_valid(t.faces, body_of_vertex(), pool) || !are_valid(t.edges, body_of_vertex(), pool)))
    check_primitives(t);
  faces_.resize(t.faces.size());
  pool.parallel_for(faces_.size(), kGrain, [&](std::size_t first, std::size_t last, int) {
    std::copy(t.faces.begin() + first, t.faces.begin() + last, faces_.data() + first);
  });
  more_edges_.assign(t.edges.begin(), t.edges.end());
}

void Mesh::take_edges(const Topology& t, TopologyFinder& finder) {
  FoundTopology found =
      finder.find({t.faces, t.edges, body_of_vertex(), body_count(), world_of_body()});
  if (!found.is_valid) {
    check_primitives(t);
    throw Error(ErrorCode::device, "the device found an invalid face, and the host did not");
  }
  edge_count_ = found.edge_count;
  cells_.set_segments(std::move(found.segments));
}

// Errors are rare, so this looks for the first one on one thread.
void Mesh::check_primitives(const Topology& t) const {
  std::vector<std::pair<Face, std::int32_t>> sorted(t.faces.size());
  for (std::size_t i = 0; i < t.faces.size(); ++i) {
    check_indices(t.faces[i], "face", i, body_of_vertex());
    Face f = t.faces[i];
    std::sort(f.begin(), f.end());
    sorted[i] = {f, static_cast<std::int32_t>(i)};
  }
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i].first != sorted[i - 1].first) continue;
    const std::int32_t body = body_of_vertex_[sorted[i].first[0]];
    throw Error(ErrorCode::duplicate_face,
                "face " + std::to_string(sorted[i].second) + " of body " + std::to_string(body) +
                    " has the vertices of face " + std::to_string(sorted[i - 1].second),
                body, sorted[i].second);
  }
  for (std::size_t i = 0; i < t.edges.size(); ++i)
    check_indices(t.edges[i], "edge", i, body_of_vertex());
}

void Mesh::find_first_faces(ThreadPool& pool) const {
  const std::size_t edge_count = edges().size();
  first_faces_.resize(edge_count + vertex_count());
  pool.parallel_for(edge_count, kGrain, [&](std::size_t first, std::size_t last, int) {
    std::copy(edges_.first_faces.begin() + first, edges_.first_faces.begin() + last,
              first_faces_.begin() + first);
  });
  SharedArray of_vertex;
  constexpr std::uint32_t none = ~std::uint32_t{0};
  of_vertex.assign(vertex_count(), none, pool);
  // Every face at a vertex is at an edge of this vertex, too.
  pool.parallel_for(edge_count, kGrain, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t e = first; e < last; ++e)
      if (first_faces_[e] >= 0)
        for (const std::int32_t v : edges()[e])
          of_vertex.lower(static_cast<std::size_t>(v), static_cast<std::uint32_t>(first_faces_[e]));
  });
  pool.parallel_for(vertex_count(), kGrain, [&](std::size_t first, std::size_t last, int) {
    for (std::size_t v = first; v < last; ++v)
      first_faces_[edge_count + v] = static_cast<std::int32_t>(of_vertex[v]);  // none: -1
  });
}

void Mesh::check_primitives_of_bodies() const {
  std::vector<char> seen(bodies_.size(), 0);
  for (const CellSegment& segment : cells_.segments()) seen[segment.body] = 1;
  for (std::size_t b = 0; b < seen.size(); ++b)
    if (!seen[b])
      throw Error(ErrorCode::empty_body,
                  "body " + std::to_string(b) + " has neither a face nor an edge",
                  static_cast<std::int32_t>(b));
}

void Mesh::leave_out(Span<const char> edges, Span<const char> vertices) {
  if (!(edges.empty() || edges.size() == edge_count()) ||
      !(vertices.empty() || vertices.size() == vertex_count()))
    throw Error(ErrorCode::size_mismatch,
                "leave_out() needs an entry for each edge and for each vertex, or none");
  edges_left_out_.assign(edges.begin(), edges.end());
  vertices_left_out_.assign(vertices.begin(), vertices.end());
}

MeshView Mesh::view() const {
  static_assert(sizeof(Face) == 3 * sizeof(std::int32_t) &&
                sizeof(Edge) == 2 * sizeof(std::int32_t));
  return {reinterpret_cast<const std::int32_t(*)[3]>(faces_.data()),
          reinterpret_cast<const std::int32_t(*)[2]>(edges_.edges.data()), body_of_vertex_.data()};
}

CellView Mesh::cell_view() const {
  return {reinterpret_cast<const std::int32_t(*)[3]>(faces_.data()),
          reinterpret_cast<const std::int32_t(*)[3]>(edges_.face_edges.data()),
          reinterpret_cast<const std::int32_t(*)[2]>(edges_.edges.data())};
}

FirstFaces Mesh::first_faces() const {
  if (faces_.empty()) return {};
  return {first_faces_.data(), static_cast<std::int32_t>(edges().size()),
          reinterpret_cast<const std::int32_t(*)[3]>(edges_.face_edges.data())};
}

ContactKey Mesh::contact_key() const {
  return ContactKey::of(static_cast<std::size_t>(world_count_), contact_order().world_of_body,
                        body_count(), vertex_count(), edge_count(), faces().size());
}

ContactOrder Mesh::contact_order() const {
  return {world_of_body_.empty() ? nullptr : world_of_body_.data()};
}

bool Mesh::collide(std::int32_t a, std::int32_t b) const {
  const Body &x = bodies_[a], &y = bodies_[b];
  if (a == b) return x.self_collision;
  return filters_accept(x, y) && (disabled_.empty() || disabled_.count(pair_key(a, b)) == 0);
}

}  // namespace lazyccd
