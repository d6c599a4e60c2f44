#include "research/culling/orphan_sets.h"

#include <algorithm>

namespace lazyccd::research {
namespace {

// The faces at each vertex or edge, in one array.
class Incidence {
 public:
  Incidence(std::size_t primitives, Span<const std::array<std::int32_t, 3>> faces)
      : first_(primitives + 1, 0) {
    for (const auto& face : faces)
      for (const std::int32_t p : face) ++first_[p + 1];
    for (std::size_t p = 0; p < primitives; ++p) first_[p + 1] += first_[p];
    faces_.resize(first_.back());
    std::vector<std::size_t> end(first_.begin(), first_.end() - 1);
    for (std::size_t f = 0; f < faces.size(); ++f)
      for (const std::int32_t p : faces[f]) faces_[end[p]++] = static_cast<std::int32_t>(f);
  }
  Span<const std::int32_t> of(std::int32_t primitive) const {
    return {faces_.data() + first_[primitive], first_[primitive + 1] - first_[primitive]};
  }

 private:
  std::vector<std::size_t> first_;
  std::vector<std::int32_t> faces_;
};

template <std::size_t N>
bool has(const std::array<std::int32_t, N>& vertices, std::int32_t v) {
  return std::find(vertices.begin(), vertices.end(), v) != vertices.end();
}

template <std::size_t N, std::size_t M>
bool share(const std::array<std::int32_t, N>& a, const std::array<std::int32_t, M>& b) {
  return std::any_of(a.begin(), a.end(), [&](std::int32_t v) { return has(b, v); });
}

}  // namespace

OrphanSets::OrphanSets(const Mesh& mesh) {
  const Span<const Face> faces = mesh.faces();
  const Incidence at_vertex(mesh.vertex_count(), faces);
  const Incidence at_edge(mesh.edges().size(), mesh.face_edges());
  const auto adjacent = [&](std::int32_t f, std::int32_t g) { return share(faces[f], faces[g]); };
  // da Silva, Algorithm 2.3: a pair is an orphan if all faces of one primitive are adjacent to all
  // faces of the other.
  const auto orphan = [&](Span<const std::int32_t> fs, Span<const std::int32_t> gs) {
    return std::all_of(fs.begin(), fs.end(), [&](std::int32_t f) {
      return std::all_of(gs.begin(), gs.end(), [&](std::int32_t g) { return adjacent(f, g); });
    });
  };
  const auto add = [&](ContactKind kind, Candidate pair, Span<const std::int32_t> fs,
                       Span<const std::int32_t> gs) {
    ++before_refinement_;
    if (kind == ContactKind::edge_edge && pair.b < pair.a) pair = {pair.b, pair.a};
    if (orphan(fs, gs)) orphans_[static_cast<int>(kind)].pairs.push_back(pair);
  };

  // da Silva, Algorithm 2.2: the elementary pairs of all adjacent faces, except pairs that share a
  // vertex.
  for (std::int32_t f = 0; f < static_cast<std::int32_t>(faces.size()); ++f) {
    std::vector<std::int32_t> neighbours;
    for (const std::int32_t v : faces[f])
      for (const std::int32_t g : at_vertex.of(v))
        if (g > f) neighbours.push_back(g);
    std::sort(neighbours.begin(), neighbours.end());
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end()), neighbours.end());
    for (const std::int32_t g : neighbours) {
      ++adjacent_faces_;
      for (const auto& [a, b] : {std::array{f, g}, std::array{g, f}}) {
        const std::array<std::int32_t, 1> one{b};
        for (const std::int32_t v : faces[a])
          if (!has(faces[b], v))
            add(ContactKind::vertex_face, {v, b}, at_vertex.of(v), {one.data(), 1});
      }
      for (const std::int32_t d : mesh.face_edges()[f])
        for (const std::int32_t e : mesh.face_edges()[g])
          if (!share(mesh.edges()[d], mesh.edges()[e]))
            add(ContactKind::edge_edge, {d, e}, at_edge.of(d), at_edge.of(e));
    }
  }
  orphans_[0].finish(mesh.vertex_count());
  orphans_[1].finish(mesh.edges().size());
}

void OrphanSets::Orphans::finish(std::size_t primitives) {
  std::sort(pairs.begin(), pairs.end(),
            [](Candidate x, Candidate y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
  const auto same = [](Candidate x, Candidate y) { return x.a == y.a && x.b == y.b; };
  pairs.erase(std::unique(pairs.begin(), pairs.end(), same), pairs.end());
  first.assign(primitives + 1, 0);
  for (const Candidate pair : pairs) ++first[pair.a + 1];
  for (std::size_t p = 0; p < primitives; ++p) first[p + 1] += first[p];
}

std::size_t OrphanSets::bytes() const {
  std::size_t sum = 0;
  for (const Orphans& orphans : orphans_)
    sum += orphans.pairs.capacity() * sizeof(Candidate) +
           orphans.first.capacity() * sizeof(std::uint32_t);
  return sum;
}

}  // namespace lazyccd::research
