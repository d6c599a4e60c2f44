// Many worlds in one detector: bodies of different worlds never meet, and a world's contacts do not
// depend on the others.
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/bvh/node_pair.h"
#include "core/narrow/contact_key.h"
#include "host/bvh/groups.h"
#include "host/bvh/tree.h"
#include "host/scene/mesh.h"
#include "host/scene/positions.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "support/catch.h"
#include "support/same_contacts.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// Bodies that are waving sheets and ropes, all around the same place.
struct Scene {
  std::vector<Body> bodies;
  std::vector<std::int32_t> body_of_vertex;
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<double> start, end;
  std::vector<std::int32_t> vertex_in_all;  // of a part: its vertices in the whole scene

  Topology topology() const {
    Topology t;
    t.vertex_count = body_of_vertex.size();
    t.faces = faces;
    t.edges = edges;
    t.body_of_vertex = body_of_vertex;
    t.bodies = bodies;
    return t;
  }
  Positions at(const std::vector<double>& x) const { return {x.data(), x.size() / 3}; }

  void add_body(std::int32_t world, bool is_rope, std::uint32_t seed) {
    std::mt19937 random(seed);
    const auto symmetric = [&random] { return random() / 2147483648.0 - 1; };
    const auto body = static_cast<std::int32_t>(bodies.size());
    bodies.emplace_back();
    bodies.back().world = world;
    const double centre[3] = {0.2 * symmetric(), 0.3 * symmetric(), 0.2 * symmetric()};
    const double tilt[2] = {symmetric(), symmetric()}, down = 0.2 * symmetric();
    const auto first = static_cast<std::int32_t>(body_of_vertex.size());
    const int n = is_rope ? 1 : 6, m = is_rope ? 20 : 6;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < m; ++j) {
        const double x = 0.1 * (i - n / 2), z = 0.1 * (j - m / 2);
        const double y = tilt[0] * x + tilt[1] * z + 0.02 * symmetric();
        start.insert(start.end(), {centre[0] + x, centre[1] + y, centre[2] + z});
        end.insert(end.end(), {centre[0] + x, centre[1] + y + down, centre[2] + z});
        body_of_vertex.push_back(body);
        const std::int32_t v = first + i * m + j;
        if (j + 1 < m && is_rope) edges.push_back({v, v + 1});
        if (i + 1 == n || j + 1 == m) continue;
        faces.push_back({v, v + 1, v + m});
        faces.push_back({v + 1, v + m + 1, v + m});
      }
  }

  // The bodies of one world and those of every world, in the same order.
  Scene part(std::int32_t world) const {
    Scene p;
    std::vector<std::int32_t> body(bodies.size(), -1), vertex(body_of_vertex.size(), -1);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      if (bodies[b].world != -1 && bodies[b].world != world) continue;
      body[b] = static_cast<std::int32_t>(p.bodies.size());
      p.bodies.push_back(bodies[b]);
    }
    for (std::size_t v = 0; v < vertex.size(); ++v) {
      if (body[body_of_vertex[v]] < 0) continue;
      vertex[v] = static_cast<std::int32_t>(p.vertex_in_all.size());
      p.vertex_in_all.push_back(static_cast<std::int32_t>(v));
      p.body_of_vertex.push_back(body[body_of_vertex[v]]);
      p.start.insert(p.start.end(), &start[3 * v], &start[3 * v] + 3);
      p.end.insert(p.end.end(), &end[3 * v], &end[3 * v] + 3);
    }
    for (Face f : faces) {
      if (vertex[f[0]] < 0) continue;
      for (std::int32_t& v : f) v = vertex[v];
      p.faces.push_back(f);
    }
    for (Edge e : edges) {
      if (vertex[e[0]] < 0) continue;
      for (std::int32_t& v : e) v = vertex[v];
      p.edges.push_back(e);
    }
    return p;
  }
};

// Worlds of different sizes, in mixed order; some bodies are in every world, world 3 is empty.
Scene mixed_worlds(int worlds) {
  Scene scene;
  std::mt19937 random(11);
  for (int i = 0; i < 6 * worlds; ++i) {
    const auto world = static_cast<std::int32_t>(random() % static_cast<unsigned>(worlds));
    scene.add_body(world == 3 ? 0 : world, i % 5 == 4, 100 + static_cast<std::uint32_t>(i));
    if (i % (2 * worlds) == 1) scene.add_body(-1, false, static_cast<std::uint32_t>(i));
  }
  return scene;
}

DetectorOptions on_cpu(int threads = 2) {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.threads = threads;
  return options;
}

// Whether the contacts of a world are those of its part alone, which numbers the vertices itself.
bool agree(Span<const Contact> among_all, Span<const Contact> alone, const Scene& part,
           Span<const Edge> edges) {
  if (among_all.size() != alone.size()) return false;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    const Contact &x = among_all[i], &y = alone[i];
    if (x.kind != y.kind || x.toi != y.toi || x.u != y.u || x.v != y.v || x.normal != y.normal)
      return false;
    for (std::size_t k = 0; k < 4; ++k)
      if (x.vertices[k] != part.vertex_in_all[y.vertices[k]]) return false;
    if (x.kind == ContactKind::edge_edge &&
        edges[x.primitive_a] !=
            Edge{std::min(x.vertices[0], x.vertices[1]), std::max(x.vertices[0], x.vertices[1])})
      return false;
  }
  return true;
}

// Checks every world of a scene against a detection without the other worlds.
void check_worlds(const Scene& scene, const DetectorOptions& options) {
  Detector all(options);
  all.set_topology(scene.topology());
  const Span<const Contact> contacts = all.detect(scene.at(scene.start), scene.at(scene.end));
  const Span<const std::size_t> offsets = all.world_offsets();
  REQUIRE(offsets.size() == static_cast<std::size_t>(all.world_count()) + 2);
  CHECK(offsets[0] == 0);
  CHECK(offsets[offsets.size() - 1] == contacts.size());
  CHECK(all.stats().hash == contact_hash(contacts));
  for (std::int32_t world = -1; world < all.world_count(); ++world) {
    CAPTURE(world);
    const Scene part = scene.part(world);
    Detector alone(options);
    alone.set_topology(part.topology());
    const Span<const Contact> of_part = alone.detect(part.at(part.start), part.at(part.end));
    if (world >= alone.world_count()) {
      CHECK(all.contacts_of_world(world).empty());
      continue;
    }
    // Alone, too, contacts between bodies of every world belong to no world.
    CHECK(agree(all.contacts_of_world(world), alone.contacts_of_world(world), part, all.edges()));
    CHECK(all.hash_of_world(world) == alone.hash_of_world(world));
    if (world >= 0)
      CHECK(of_part.size() ==
            alone.contacts_of_world(world).size() + all.contacts_of_world(-1).size());
    CHECK(offsets[static_cast<std::size_t>(world + 2)] -
              offsets[static_cast<std::size_t>(world + 1)] ==
          all.contacts_of_world(world).size());
  }
}

}  // namespace

TEST_CASE("a world's contacts are the same bits alone and among many worlds at the same place") {
  const Scene scene = mixed_worlds(9);
  DetectorOptions options = on_cpu();
  SECTION("touching") {}
  SECTION("with a separation") { options.separation = 0.01; }
  SECTION("with a separation, reduced") {
    options.separation = 0.01;
    options.reduce_contacts = true;
  }
  check_worlds(scene, options);
  Detector detector(options);
  detector.set_topology(scene.topology());
  CHECK(detector.detect(scene.at(scene.start), scene.at(scene.end)).size() > 500);
  CHECK(detector.contacts_of_world(3).empty());
  CHECK(!detector.contacts_of_world(-1).empty());
}

TEST_CASE("many worlds have the same contacts with every strategy, volume, culling and front") {
  const Scene scene = mixed_worlds(7);
  Detector reference(on_cpu(1));
  reference.set_topology(scene.topology());
  const Span<const Contact> expected = reference.detect(scene.at(scene.start), scene.at(scene.end));
  const auto check = [&](const DetectorOptions& options) {
    Detector detector(options);
    detector.set_topology(scene.topology());
    for (int step = 0; step < 3; ++step)
      CHECK(same_contacts(detector.detect(scene.at(scene.start), scene.at(scene.end)), expected));
  };
  for (const Strategy strategy : kStrategies) {
    DetectorOptions options = on_cpu(3);
    options.algorithm.strategy = strategy;
    check(options);
    options.algorithm.front = FrontUse::on;
    check(options);
  }
  for (const Volume volume : kVolumes) {
    DetectorOptions options = on_cpu();
    options.algorithm.volume = volume;
    options.algorithm.culling.normal_cones = options.algorithm.culling.orphan_sets = true;
    check(options);
  }
}

TEST_CASE("contacts of many worlds stay the same with Verlet lists and when detected ahead") {
  const Scene scene = mixed_worlds(5);
  DetectorOptions options = on_cpu();
  options.separation = 0.02;
  Detector reference(on_cpu());
  for (const bool ahead : {false, true}) {
    Detector detector(options);
    detector.set_topology(scene.topology());
    for (int step = 0; step < 6; ++step) {
      std::vector<double> from = scene.start, to = scene.start;
      for (std::size_t i = 0; i < from.size(); ++i) {
        from[i] += 1e-4 * step * (scene.end[i] - scene.start[i]);
        to[i] += 1e-4 * (step + 1) * (scene.end[i] - scene.start[i]);
      }
      if (ahead) detector.detect_ahead(scene.at(from), scene.at(to), 1e-3);
      const Span<const Contact> contacts = detector.detect(scene.at(from), scene.at(to));
      Detector fresh(options);
      fresh.set_topology(scene.topology());
      CHECK(same_contacts(contacts, fresh.detect(scene.at(from), scene.at(to))));
      CHECK(contacts.size() > 100);
    }
  }
}

TEST_CASE("no pair of nodes of different worlds is ever visited, and no pair of one is missed") {
  const Scene scene = mixed_worlds(8);
  const Mesh mesh(scene.topology());
  ThreadPool pool(1);
  std::vector<VertexRecord> records;
  load_records(mesh, scene.at(scene.start), scene.at(scene.end), pool, records);
  Groups groups;
  groups.build(mesh, records, pool);
  Tree tree;
  tree.build(groups.codes(), groups.boxes(), pool, groups.worlds());
  const auto worlds_below = [&](std::uint32_t node) {
    std::set<std::int32_t> worlds;
    const Tree::Range range = tree.ranges()[node];
    for (std::int32_t i = range.first; i < range.last; ++i)
      worlds.insert(groups.worlds()[static_cast<std::size_t>(tree.order()[i])]);
    return worlds;
  };
  std::vector<NodePair> open{{0, 0}};
  std::set<std::pair<std::int32_t, std::int32_t>> found;
  bool all_share_a_world = true;
  while (!open.empty()) {
    const NodePair pair = open.back();
    open.pop_back();
    const std::set<std::int32_t> a = worlds_below(pair.a), b = worlds_below(pair.b);
    all_share_a_world = all_share_a_world &&
                        (a.count(-1) != 0 || b.count(-1) != 0 ||
                         std::find_first_of(a.begin(), a.end(), b.begin(), b.end()) != a.end());
    const TreeNode &x = tree.nodes()[pair.a], &y = tree.nodes()[pair.b];
    const PairVisit v = visit(pair, x, y);
    for (int i = 0; i < v.children; ++i) open.push_back(v.child[i]);
    if (v.overlaps && v.children == 0) found.insert(std::minmax(x.group(), y.group()));
  }
  CHECK(all_share_a_world);
  std::set<std::pair<std::int32_t, std::int32_t>> expected;
  for (const TreeNode& x : tree.nodes())
    for (const TreeNode& y : tree.nodes()) {
      if (!x.leaf() || !y.leaf() || x.group() > y.group() || !overlap(x, y)) continue;
      const std::int32_t a = groups.worlds()[static_cast<std::size_t>(x.group())],
                         b = groups.worlds()[static_cast<std::size_t>(y.group())];
      if (a == b || a == -1 || b == -1) expected.insert({x.group(), y.group()});
    }
  CHECK(found == expected);
}

TEST_CASE("a scene of one world needs no -1, and an empty world has no contacts") {
  Scene scene;
  for (std::uint32_t i = 0; i < 8; ++i) scene.add_body(0, false, i);
  const std::int32_t world = GENERATE(-1, 0, 2);
  for (Body& body : scene.bodies) body.world = world;
  Detector detector(on_cpu());
  detector.set_topology(scene.topology());
  const Span<const Contact> all = detector.detect(scene.at(scene.start), scene.at(scene.end));
  CHECK(detector.world_count() == world + 1);
  for (std::int32_t w = -1; w < detector.world_count(); ++w)
    CHECK(detector.contacts_of_world(w).size() == (w == world ? all.size() : 0));
  CHECK(detector.hash_of_world(world) == detector.stats().hash);
}

TEST_CASE("a world that does not exist is an error") {
  Scene scene;
  scene.add_body(0, false, 1);
  Detector detector(on_cpu());
  detector.set_topology(scene.topology());
  detector.detect(scene.at(scene.start), scene.at(scene.end));
  CHECK_THROWS_AS(detector.contacts_of_world(1), Error);
  CHECK_THROWS_AS(detector.contacts_of_world(-2), Error);
  scene.bodies[0].world = -2;
  CHECK_THROWS_AS(detector.set_topology(scene.topology()), Error);
}

TEST_CASE("keys of two words order contacts as worlds, bodies and primitives do") {
  std::vector<std::int32_t> world_of_body;
  for (std::int32_t b = 0; b < 1000; ++b) world_of_body.push_back(b * 7 % 31 - 1);
  const std::int32_t* const worlds = GENERATE(true, false) ? world_of_body.data() : nullptr;
  const ContactKey narrow = ContactKey::of(30, worlds, 1000, 300, 300, 300);
  const ContactKey wide = ContactKey::of(30, worlds, 1000, 1 << 30, 1 << 30, 1 << 29);
  CHECK(narrow.is_one_word());
  CHECK(!wide.is_one_word());
  CHECK(wide.is_two_words());
  std::mt19937 random(3);
  const auto draw = [&](std::int32_t end) {
    return static_cast<std::int32_t>(random() % static_cast<unsigned>(end));
  };
  std::vector<Contact> contacts;
  for (int i = 0; i < 400; ++i) {
    Contact c{};
    c.body_a = draw(i % 2 == 0 ? 3 : 1000);
    c.body_b = draw(i % 3 == 0 ? 3 : 1000);
    c.kind = static_cast<ContactKind>(draw(2));
    c.primitive_a = draw(i % 4 == 0 ? 2 : 300);
    c.primitive_b = draw(300);
    contacts.push_back(c);
  }
  const ContactOrder order{worlds};
  bool good = true;
  for (const Contact& x : contacts)
    for (const Contact& y : contacts) {
      const std::pair<std::uint64_t, std::uint64_t> of_x{wide.upper(x), wide(x)},
          of_y{wide.upper(y), wide(y)};
      good = good && order(x, y) == (narrow(x) < narrow(y)) && order(x, y) == (of_x < of_y);
    }
  CHECK(good);
}

TEST_CASE("thousands of worlds with more bodies and primitives than one word of the key holds") {
  // Two triangles that pass through each other, again and again.
  const int worlds = 16384;
  Scene scene;
  for (std::int32_t i = 0; i < 2 * worlds; ++i) {
    scene.bodies.emplace_back();
    scene.bodies.back().world = (i * 4099) % worlds;
    const bool is_second = i >= worlds;
    const double y = is_second ? 0.3 : 0.0, dy = is_second ? -0.6 : 0;
    for (const auto& [x, z] : {std::pair{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}}) {
      const double aside = is_second ? 0.1 : 0.0;
      scene.start.insert(scene.start.end(), {x + aside, y, z + aside});
      scene.end.insert(scene.end.end(), {x + aside, y + dy, z + aside});
      scene.body_of_vertex.push_back(i);
    }
    scene.faces.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const Mesh mesh(scene.topology());
  CHECK(!mesh.contact_key().is_one_word());
  Detector detector(on_cpu());
  detector.set_topology(scene.topology());
  const Span<const Contact> contacts = detector.detect(scene.at(scene.start), scene.at(scene.end));
  const std::size_t of_each = detector.contacts_of_world(0).size();
  CHECK(of_each > 0);
  CHECK(contacts.size() == of_each * static_cast<std::size_t>(worlds));
  CHECK(std::is_sorted(contacts.begin(), contacts.end(), mesh.contact_order()));
  const std::uint64_t hash = detector.hash_of_world(0);
  bool good = true;
  for (std::int32_t w = 0; w < worlds; ++w)
    good = good && detector.contacts_of_world(w).size() == of_each &&
           detector.hash_of_world(w) == hash;
  CHECK(good);
  // No pair of different worlds costs anything: two leaves and their parent in each world.
  CHECK(detector.stats().tree_tests <= 5 * worlds);
}

TEST_CASE("worlds with numbers near 2^31 take no more memory than others") {
  Scene small, large;
  const std::int32_t last = 0x7ffffffe;
  for (std::uint32_t i = 0; i < 12; ++i) {
    small.add_body(static_cast<std::int32_t>(i % 4) - 1, i % 5 == 0, i);
    large.add_body(i % 4 == 0 ? -1 : last - 1000 * (3 - static_cast<std::int32_t>(i % 4)),
                   i % 5 == 0, i);
  }
  Detector a(on_cpu()), b(on_cpu());
  a.set_topology(small.topology());
  b.set_topology(large.topology());
  const Span<const Contact> wanted = a.detect(small.at(small.start), small.at(small.end));
  const Span<const Contact> found = b.detect(large.at(large.start), large.at(large.end));
  CHECK(wanted.size() > 0);
  CHECK(same_contacts(found, wanted));
  CHECK(b.world_count() == last + 1);
  CHECK(b.contacts_of_world(12345).empty());
  CHECK(b.hash_of_world(12345) == 0);
  for (std::int32_t w = -1; w < 3; ++w) {
    const std::int32_t name = w < 0 ? -1 : last - 1000 * (2 - w);
    CHECK(same_contacts(b.contacts_of_world(name), a.contacts_of_world(w)));
    CHECK(b.hash_of_world(name) == a.hash_of_world(w));
  }
}
