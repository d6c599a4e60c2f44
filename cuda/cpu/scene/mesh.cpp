#include "cpu/scene/mesh.h"

#include <algorithm>
#include <string>

#include "lazyccd/error.h"

namespace lazyccd {
namespace {

// Sort key of an edge: the larger vertex index first, then the smaller.
std::uint64_t edge_key(std::int32_t a, std::int32_t b) {
  const std::uint64_t lo = static_cast<std::uint32_t>(std::min(a, b));
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(std::max(a, b))) << 32 | lo;
}

std::uint64_t pair_key(std::int32_t a, std::int32_t b) {
  const std::uint64_t lo = static_cast<std::uint32_t>(std::min(a, b));
  return lo << 32 | static_cast<std::uint32_t>(std::max(a, b));
}

// Checks one face or edge against the vertex table; `what` is "face" or "edge".
template <std::size_t N>
void check_indices(const std::array<std::int32_t, N>& v, const char* what, std::size_t index,
                   const std::vector<std::int32_t>& body_of_vertex) {
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

Mesh::Mesh(const Topology& topology) {
  take_bodies(topology);
  take_faces(topology);
  take_edges(topology);
  find_first_faces();
  check_primitives_of_bodies();
}

void Mesh::take_bodies(const Topology& t) {
  const auto fits = [&](std::size_t size) { return size == 0 || size == t.vertex_count; };
  if (!fits(t.body_of_vertex.size()) || !fits(t.inverse_mass.size()) ||
      !fits(t.self_separation.size()))
    throw Error(ErrorCode::size_mismatch,
                "body_of_vertex, inverse_mass and self_separation need an entry for each of the " +
                    std::to_string(t.vertex_count) + " vertices, or none");
  body_of_vertex_.assign(t.vertex_count, 0);
  std::copy(t.body_of_vertex.begin(), t.body_of_vertex.end(), body_of_vertex_.begin());

  std::int32_t named = 0;
  for (const std::int32_t b : body_of_vertex_) named = std::max(named, b + 1);
  bodies_.assign(t.bodies.begin(), t.bodies.end());
  if (bodies_.empty()) bodies_.resize(static_cast<std::size_t>(named));
  const auto check_body = [&](std::int32_t body, const char* what, std::size_t index) {
    if (body < 0 || static_cast<std::size_t>(body) >= bodies_.size())
      throw Error(ErrorCode::index_out_of_range,
                  std::string(what) + " " + std::to_string(index) + ": body " +
                      std::to_string(body) + " is outside [0, " + std::to_string(bodies_.size()) +
                      ")",
                  body, static_cast<std::int32_t>(index));
  };
  for (std::size_t v = 0; v < body_of_vertex_.size(); ++v)
    check_body(body_of_vertex_[v], "vertex", v);
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
  self_separation_.assign(t.self_separation.begin(), t.self_separation.end());
  if (std::find(t.inverse_mass.begin(), t.inverse_mass.end(), 0.0f) != t.inverse_mass.end()) {
    pinned_.resize(t.vertex_count);
    for (std::size_t v = 0; v < t.vertex_count; ++v) pinned_[v] = t.inverse_mass[v] == 0.0f;
  }
}

void Mesh::take_faces(const Topology& t) {
  faces_.assign(t.faces.begin(), t.faces.end());
  std::vector<std::pair<Face, std::int32_t>> sorted(faces_.size());
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    check_indices(faces_[i], "face", i, body_of_vertex_);
    Face f = faces_[i];
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
}

void Mesh::take_edges(const Topology& t) {
  std::vector<std::uint64_t> keys;
  keys.reserve(3 * faces_.size() + t.edges.size());
  for (const Face& f : faces_)
    for (int i = 0; i < 3; ++i) keys.push_back(edge_key(f[i], f[(i + 1) % 3]));
  for (std::size_t i = 0; i < t.edges.size(); ++i) {
    check_indices(t.edges[i], "edge", i, body_of_vertex_);
    keys.push_back(edge_key(t.edges[i][0], t.edges[i][1]));
  }
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  edges_.reserve(keys.size());
  for (const std::uint64_t k : keys)
    edges_.push_back(
        {static_cast<std::int32_t>(k & 0xffffffffu), static_cast<std::int32_t>(k >> 32)});

  std::vector<char> of_face(keys.size(), 0);
  face_edges_.resize(faces_.size());
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    for (int i = 0; i < 3; ++i) {
      const std::uint64_t key = edge_key(faces_[f][i], faces_[f][(i + 1) % 3]);
      const auto e = std::lower_bound(keys.begin(), keys.end(), key) - keys.begin();
      face_edges_[f][i] = static_cast<std::int32_t>(e);
      of_face[e] = 1;
    }
  }
  for (std::size_t e = 0; e < edges_.size(); ++e)
    if (!of_face[e]) free_edges_.push_back(static_cast<std::int32_t>(e));
}

void Mesh::find_first_faces() {
  first_faces_.assign(edges_.size() + vertex_count(), -1);
  const auto is_pinned = [this](std::int32_t v) { return pinned(v); };
  for (std::size_t f = faces_.size(); f-- > 0;) {
    if (std::all_of(faces_[f].begin(), faces_[f].end(), is_pinned)) continue;
    for (const std::int32_t e : face_edges_[f]) first_faces_[e] = static_cast<std::int32_t>(f);
    for (const std::int32_t v : faces_[f])
      first_faces_[edges_.size() + static_cast<std::size_t>(v)] = static_cast<std::int32_t>(f);
  }
}

void Mesh::check_primitives_of_bodies() const {
  std::vector<char> seen(bodies_.size(), 0);
  for (const Edge& e : edges_) seen[body_of_vertex_[e[0]]] = 1;
  for (std::size_t b = 0; b < seen.size(); ++b)
    if (!seen[b])
      throw Error(ErrorCode::empty_body,
                  "body " + std::to_string(b) + " has neither a face nor an edge",
                  static_cast<std::int32_t>(b));
}

MeshView Mesh::view() const {
  static_assert(sizeof(Face) == 3 * sizeof(std::int32_t) &&
                sizeof(Edge) == 2 * sizeof(std::int32_t));
  return {reinterpret_cast<const std::int32_t(*)[3]>(faces_.data()),
          reinterpret_cast<const std::int32_t(*)[2]>(edges_.data()), body_of_vertex_.data()};
}

FirstFaces Mesh::first_faces() const {
  if (faces_.empty()) return {};
  return {first_faces_.data(), static_cast<std::int32_t>(edges_.size()),
          reinterpret_cast<const std::int32_t(*)[3]>(face_edges_.data())};
}

ContactKey Mesh::contact_key() const {
  return ContactKey::of(body_count(), vertex_count(), edges_.size(), faces_.size());
}

bool Mesh::collide(std::int32_t a, std::int32_t b) const {
  const Body &x = bodies_[a], &y = bodies_[b];
  if (a == b) return x.self_collision;
  return filters_accept(x, y) && (disabled_.empty() || disabled_.count(pair_key(a, b)) == 0);
}

}  // namespace lazyccd
