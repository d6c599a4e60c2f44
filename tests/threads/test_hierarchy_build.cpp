// The edges, the groups and the tree are those that a plain serial construction gives, with any
// number of threads.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/bvh/morton.h"
#include "core/bvh/radix_tree.h"
#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "host/scene/positions.h"
#include "host/threads/key_sort.h"
#include "support/build_scenes.h"
#include "support/catch.h"
#include "support/generators.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

std::vector<VertexRecord> records_of(const BuildScene& scene) {
  std::vector<VertexRecord> records(scene.x.size() / 3);
  for (std::size_t v = 0; v < records.size(); ++v)
    for (std::size_t k = 0; k < 3; ++k) {
      records[v].x[k] = scene.x[3 * v + k];
      records[v].x[3 + k] = scene.x[3 * v + k] + 0.01;
    }
  return records;
}

// The primitives that the groups own, found one after the other.
struct PlainGroup {
  std::int32_t body, world;
  bool pinned;
  std::vector<std::int32_t> ids[3];
  std::uint64_t code;
};

MortonFrame frame_of(const std::vector<std::array<double, 3>>& points) {
  std::array<double, 3> lo = points.front(), hi = points.front();
  for (const auto& p : points)
    for (std::size_t k = 0; k < 3; ++k) {
      lo[k] = std::min(lo[k], p[k]);
      hi[k] = std::max(hi[k], p[k]);
    }
  return MortonFrame::around(lo.data(), hi.data());
}

std::vector<PlainGroup> plain_groups(const Mesh& mesh, const std::vector<VertexRecord>& records) {
  std::vector<std::array<double, 3>> points;
  for (const VertexRecord& r : records) points.push_back({r.x[0], r.x[1], r.x[2]});
  const MortonFrame frame = frame_of(points);
  const auto code = [&](const auto& corners) {
    return centroid_code(frame, corners.data(), static_cast<int>(corners.size()),
                         [&](std::int32_t v) { return records[v].x; });
  };
  // World, body, whether an edge, code, primitive.
  std::vector<std::tuple<std::int32_t, std::int32_t, bool, std::uint64_t, std::int32_t>> cells;
  const auto add = [&](std::int32_t vertex, bool is_edge, std::uint64_t cell_code, std::size_t id) {
    const std::int32_t body = mesh.body_of_vertex()[vertex];
    cells.emplace_back(mesh.bodies()[body].world, body, is_edge, cell_code, id);
  };
  for (std::size_t f = 0; f < mesh.faces().size(); ++f)
    add(mesh.faces()[f][0], false, code(mesh.faces()[f]), f);
  for (const std::int32_t e : mesh.free_edges())
    add(mesh.edges()[e][0], true, code(mesh.edges()[e]), static_cast<std::size_t>(e));
  std::sort(cells.begin(), cells.end());
  std::vector<PlainGroup> groups;
  std::set<std::int32_t> owned[3];
  for (std::size_t begin = 0, end; begin < cells.size(); begin = end) {
    struct {
      double lo[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    } box;
    PlainGroup group{std::get<1>(cells[begin]), std::get<0>(cells[begin]), true, {}, 0};
    const auto claim = [&](int kind, std::int32_t id) {
      if (owned[kind].insert(id).second) group.ids[kind].push_back(id);
    };
    for (end = begin; end < cells.size() && end < begin + kGroupCells; ++end) {
      const auto& [world, body, is_edge, unused, id] = cells[end];
      if (body != group.body || is_edge != std::get<2>(cells[begin])) break;
      const auto take = [&](const auto& vertices) {
        for (const std::int32_t v : vertices) {
          claim(kVertices, v);
          for (std::size_t k = 0; k < 3; ++k) {
            box.lo[k] = std::min(box.lo[k], records[v].x[k]);
            box.hi[k] = std::max(box.hi[k], records[v].x[k]);
          }
          group.pinned = group.pinned && mesh.pinned(v);
        }
      };
      if (is_edge) {
        claim(kEdges, id);
        take(mesh.edges()[id]);
      } else {
        claim(kFaces, id);
        for (const std::int32_t e : mesh.face_edges()[id]) claim(kEdges, e);
        take(mesh.faces()[id]);
      }
    }
    double centre[3];
    for (std::size_t k = 0; k < 3; ++k) centre[k] = 0.5 * box.lo[k] + 0.5 * box.hi[k];
    group.code = frame.code(centre);
    groups.push_back(group);
  }
  return groups;
}

// Checks the groups against the plain ones. Returns whether all agree.
bool agree(const Groups& groups, const std::vector<PlainGroup>& plain, const Mesh& mesh) {
  if (groups.groups().size() != plain.size()) return false;
  std::int32_t block = 0;
  for (std::size_t g = 0; g < plain.size(); ++g) {
    const Group& group = groups.groups()[g];
    if (groups.codes()[g] != plain[g].code) return false;
    if (group.body != plain[g].body || (group.pinned != 0) != plain[g].pinned) return false;
    for (int kind = 0; kind < 3; ++kind) {
      const std::vector<std::int32_t>& ids = plain[g].ids[kind];
      if (group.count[kind] != static_cast<int>(ids.size()) || group.first[kind] != block)
        return false;
      block += group.blocks(kind);
      for (int i = 0; i < group.blocks(kind) * kBlockLanes; ++i) {
        const Block& b = groups.blocks()[group.first[kind] + i / kBlockLanes];
        const int lane = i % kBlockLanes;
        std::vector<std::int32_t> names(4, -1);
        if (i < group.count[kind]) {
          const std::int32_t id = names[0] = ids[i];
          if (kind == kVertices) names[1] = id;
          if (kind == kEdges) std::copy_n(mesh.edges()[id].begin(), 2, names.begin() + 1);
          if (kind == kFaces) std::copy_n(mesh.faces()[id].begin(), 3, names.begin() + 1);
        }
        if (b.id[lane] != names[0]) return false;
        for (int k = 0; k < 3; ++k)
          if (b.vertex[k][lane] != names[k + 1]) return false;
      }
    }
  }
  return block == static_cast<std::int32_t>(groups.blocks().size());
}

// The nodes of the radix tree over the leaves, split one after the other by linear search.
void check_tree(const Tree& tree, const std::vector<PlainGroup>& groups) {
  struct Leaf {
    std::int32_t world;
    std::uint64_t code;
    std::int32_t group;
    bool operator<(const Leaf& o) const {
      return std::tie(world, code, group) < std::tie(o.world, o.code, o.group);
    }
  };
  std::vector<Leaf> leaves;
  std::vector<std::uint64_t> codes;
  std::vector<std::int32_t> worlds;
  for (const PlainGroup& group : groups)
    leaves.push_back({group.world, group.code, static_cast<std::int32_t>(leaves.size())});
  std::sort(leaves.begin(), leaves.end());
  bool good = tree.order().size() == leaves.size() && tree.nodes().size() == 2 * leaves.size() - 1;
  REQUIRE(good);
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    good = good && tree.order()[i] == leaves[i].group;
    codes.push_back(leaves[i].code);
    worlds.push_back(leaves[i].world);
  }
  struct Open {
    std::int32_t node, first, last;
  };
  std::vector<Open> open{{0, 0, static_cast<std::int32_t>(leaves.size())}};
  std::int32_t used = 1;
  std::set<std::pair<std::int32_t, std::int32_t>> inner;
  while (!open.empty() && good) {
    const Open at = open.back();
    open.pop_back();
    const TreeNode& n = tree.nodes()[at.node];
    good =
        good && tree.ranges()[at.node].first == at.first && tree.ranges()[at.node].last == at.last;
    if (at.last - at.first == 1) {
      good = good && n.left == -1 - leaves[at.first].group && n.right_link == -1;
      continue;
    }
    inner.insert({at.first, at.last});
    const auto key_bit = [&](std::int32_t i, int bit) {
      // The sign of the world comes first, turned over.
      if (bit >= 64) return static_cast<int>((leaves[i].world ^ (1 << 31)) >> (bit - 64) & 1);
      return bit < 0 ? i >> (bit + 32) & 1 : static_cast<int>(leaves[i].code >> bit & 1);
    };
    int bit = 95;
    while (key_bit(at.first, bit) == key_bit(at.last - 1, bit)) --bit;
    std::int32_t middle = at.first;
    while (key_bit(middle, bit) == 0) ++middle;
    good = good && n.left == used && n.right() == used + 1;
    const std::int32_t below = leaves[middle - 1].world, above = leaves[middle].world;
    good = good && n.separates_worlds() == (below >= 0 && below != above);
    used += 2;
    open.push_back({n.right(), middle, at.last});
    open.push_back({n.left, at.first, middle});
  }
  CHECK(good);
  // Every node can be found by itself.
  const LeafCodes all{codes.data(), static_cast<std::int32_t>(codes.size()), worlds.data()};
  std::vector<InnerNode> found;
  std::vector<ParentLink> links(codes.size());
  for (std::int32_t i = 0; i + 1 < all.count; ++i) {
    const LeafRange r = inner_node(all, i);
    good = good && inner.erase({r.first, r.last}) == 1 && (i != 0 || r.last == all.count);
    found.push_back({r, all.split(r.first, r.last)});
    if (!found.back().left_is_leaf()) links[found.back().split - 1] = ParentLink::to(i, true);
    if (!found.back().right_is_leaf()) links[found.back().split] = ParentLink::to(i, false);
  }
  CHECK(good);
  CHECK(inner.empty());
  for (std::int32_t i = 0; i + 1 < all.count; ++i) {
    const NodePlaces places = places_of(i, found.data(), links.data());
    const LeafRange r = tree.ranges()[places.own];
    good = good && r.first == found[i].leaves.first && r.last == found[i].leaves.last &&
           tree.nodes()[places.own].left == places.left &&
           tree.nodes()[places.own].right() == places.right &&
           tree.ranges()[places.right].first == found[i].split;
  }
  CHECK(good);
}

template <class Items>
bool same_bytes(const Items& a, const Items& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0);
}

}  // namespace

TEST_CASE("edges, groups and tree are those of a plain serial construction, for any threads") {
  for (const BuildScene& scene : build_scenes()) {
    CAPTURE(scene.name);
    const std::vector<VertexRecord> records = records_of(scene);
    const Mesh serial(scene.topology());
    const std::vector<PlainGroup> plain = plain_groups(serial, records);
    ThreadPool one(1);
    Groups first;
    first.build(serial, records, one, 2);
    CHECK(agree(first, plain, serial));
    Tree first_tree;
    first_tree.build(first.codes(), first.boxes(), one, first.worlds());
    check_tree(first_tree, plain);
    for (const int threads : {2, 5}) {
      CAPTURE(threads);
      ThreadPool pool(threads);
      const Mesh mesh(scene.topology(), pool);
      CHECK(same_bytes(mesh.edges(), serial.edges()));
      CHECK(same_bytes(mesh.face_edges(), serial.face_edges()));
      CHECK(same_bytes(mesh.free_edges(), serial.free_edges()));
      const std::size_t owners = mesh.edges().size() + mesh.vertex_count();
      CHECK(
          (mesh.faces().empty() || std::equal(mesh.first_faces().of, mesh.first_faces().of + owners,
                                              serial.first_faces().of)));
      Groups groups;
      Tree tree;
      for (int repeat = 0; repeat < 3; ++repeat) {  // the last ones into memory that is used
        groups.build(mesh, records, pool, 2);
        tree.build(groups.codes(), groups.boxes(), pool, groups.worlds());
        CHECK(same_bytes(groups.groups(), first.groups()));
        CHECK(same_bytes(groups.blocks(), first.blocks()));
        CHECK(same_bytes(groups.boxes(), first.boxes()));
        CHECK(same_bytes(tree.nodes(), first_tree.nodes()));
        CHECK(same_bytes(tree.order(), first_tree.order()));
        CHECK(same_bytes(tree.ranges(), first_tree.ranges()));
        CHECK(tree.cost() == first_tree.cost());
      }
    }
  }
}

TEST_CASE("the edges of a mesh are unique and sorted, and each knows its first unpinned face") {
  for (const BuildScene& scene : build_scenes()) {
    CAPTURE(scene.name);
    const Mesh mesh(scene.topology());
    std::set<std::pair<std::int32_t, std::int32_t>> edges, sides;  // larger, smaller vertex
    for (const Face& f : scene.faces)
      for (std::size_t i = 0; i < 3; ++i)
        sides.insert(std::minmax(f[i], f[(i + 1) % 3], std::greater<>()));
    edges = sides;
    for (const Edge& e : scene.edges) edges.insert(std::minmax(e[0], e[1], std::greater<>()));
    REQUIRE(edges.size() == mesh.edges().size());
    std::size_t i = 0, free = 0;
    bool good = true;
    for (const auto& [larger, smaller] : edges) {
      good = good && mesh.edges()[i] == Edge{smaller, larger};
      if (sides.count({larger, smaller}) == 0)
        good = good && free < mesh.free_edges().size() &&
               mesh.free_edges()[free++] == static_cast<std::int32_t>(i);
      ++i;
    }
    CHECK(good);
    CHECK(free == mesh.free_edges().size());
    std::vector<std::int32_t> first(mesh.edges().size() + mesh.vertex_count(), -1);
    for (std::size_t f = scene.faces.size(); f-- > 0;) {
      const Face& v = scene.faces[f];
      for (std::size_t k = 0; k < 3; ++k) {
        const Edge& e = mesh.edges()[mesh.face_edges()[f][k]];
        good = good && e[0] == std::min(v[k], v[(k + 1) % 3]) &&
               e[1] == std::max(v[k], v[(k + 1) % 3]);
        if (mesh.pinned(v[0]) && mesh.pinned(v[1]) && mesh.pinned(v[2])) continue;
        first[mesh.face_edges()[f][k]] = static_cast<std::int32_t>(f);
        first[mesh.edges().size() + static_cast<std::size_t>(v[k])] = static_cast<std::int32_t>(f);
      }
    }
    CHECK(good);
    CHECK((scene.faces.empty() || std::equal(first.begin(), first.end(), mesh.first_faces().of)));
  }
}

TEST_CASE("keys are sorted, and equal keys by index, whatever their bits and the threads") {
  Random random(11);
  struct Kind {
    const char* name;
    std::uint64_t (*key)(std::size_t, Random&);
  };
  const Kind kinds[] = {
      {"random", [](std::size_t, Random& r) { return r.bits() >> 1; }},
      {"equal", [](std::size_t, Random&) { return std::uint64_t{77}; }},
      {"few", [](std::size_t, Random& r) { return r.bits() & 0x7000000000000003u; }},
      {"low bits", [](std::size_t, Random& r) { return r.bits() & 0xffff; }},
      {"descending", [](std::size_t i, Random&) { return ~static_cast<std::uint64_t>(i); }},
      {"one far away",
       [](std::size_t i, Random& r) { return i == 9 ? ~std::uint64_t{0} : r.bits() >> 40; }},
      {"clusters",
       [](std::size_t i, Random& r) { return (i % 3) << 61 | (i % 7) << 30 | (r.bits() & 0xff); }},
  };
  for (const Kind& kind : kinds) {
    for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{1000},
                                   std::size_t{20000}, std::size_t{150000}}) {
      NoinitVector<KeyedIndex> items(size);
      for (std::size_t i = 0; i < size; ++i)
        items[i] = {kind.key(i, random), static_cast<std::int32_t>(i)};
      NoinitVector<KeyedIndex> expected = items;
      std::sort(expected.begin(), expected.end());
      for (const int threads : {1, 3}) {
        CAPTURE(kind.name, size, threads);
        ThreadPool pool(threads);
        KeySort sort;
        sort.items = items;
        sort.sort(0, size, pool);
        CHECK(std::equal(expected.begin(), expected.end(), sort.items.begin(), sort.items.end(),
                         [](const KeyedIndex& a, const KeyedIndex& b) {
                           return a.key == b.key && a.index == b.index;
                         }));
      }
    }
  }
}
