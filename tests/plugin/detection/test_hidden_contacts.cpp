// HiddenContacts drops near contacts that lie behind others.
#include "detection/hidden_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "plugin/support/worlds.h"
#include "support/catch.h"
#include "support/test_budget.h"

using namespace lazyccd;
using namespace lazyccd::test;
using bullet::ConstraintKey;
using bullet::Vector3d;

namespace {

using Point = std::array<double, 3>;

// A vertex or an edge, and triangles or edges near it. Each is a body of its own.
struct Layers {
  bullet::Motion motion;
  std::vector<Contact> contacts;
  std::vector<bullet::RowEstimate> estimates;
  std::vector<bullet::ReductionEntry> entries;
  std::vector<bool> is_rigid{false};
  bool stop_each_other = true;

  explicit Layers(const std::vector<Point>& own) { add_vertices(own); }

  std::int32_t add_vertices(const std::vector<Point>& points, const Point& move = {0, 0, 0}) {
    const auto first = static_cast<std::int32_t>(motion.size());
    for (const Point& p : points) {
      for (std::size_t k = 0; k < 3; ++k) {
        motion.input().start.push_back(static_cast<btScalar>(p[k]));
        motion.end.push_back(static_cast<btScalar>(p[k] + move[k]));
      }
    }
    return first;
  }

  // A contact of vertex 0, or of the edge of vertices 0 and 1, with these points.
  Contact& add(const std::vector<Point>& points, const std::array<float, 3>& normal, double gap,
               const Point& move = {0, 0, 0}) {
    const std::int32_t first = add_vertices(points, move);
    const auto body = static_cast<std::int32_t>(is_rigid.size());
    is_rigid.push_back(false);
    Contact contact{};
    contact.body_b = body;
    contact.normal = normal;
    contact.primitive_b = body;
    if (points.size() == 3) {
      contact.kind = ContactKind::vertex_face;
      contact.vertices = {0, first, first + 1, first + 2};
      contact.u = contact.v = 0.25F;
    } else {
      contact.kind = ContactKind::edge_edge;
      contact.vertices = {0, 1, first, first + 1};
      contact.u = contact.v = 0.5F;
    }
    contacts.push_back(contact);
    estimates.push_back({});
    estimates.back().can_act = true;
    entries.push_back({});
    entries.back().key.kind = ConstraintKey::unique;
    entries.back().gap = gap;
    return contacts.back();
  }

  // A triangle that has the point of the contact at `at`, in the plane across `normal`.
  Contact& add_face(const Point& at, const std::array<float, 3>& normal,
                    const Point& move = {0, 0, 0}) {
    const bool is_level = normal[1] != 0;
    const auto corner = [&](double s, double t) {
      return is_level ? Point{at[0] + s, at[1], at[2] + t} : Point{at[0], at[1] + s, at[2] + t};
    };
    // Weights 1/2, 1/4, 1/4.
    const double gap = std::hypot(at[0], at[1], at[2]);
    return add({corner(-1, 0), corner(1, -1), corner(1, 1)}, normal, gap, move);
  }

  std::vector<bool> kept(int threads = 1) {
    motion.input().rigid_of_body.clear();
    for (const bool rigid : is_rigid) motion.input().rigid_of_body.push_back(rigid ? 0 : -1);
    bullet::HiddenContacts hidden(
        [this](std::int32_t a, std::int32_t b) { return a == b || stop_each_other; });
    std::vector<bullet::ReductionEntry> left = entries;
    hidden.drop({contacts, estimates}, motion, Threads(threads), left);
    std::vector<bool> kept;
    for (const bullet::ReductionEntry& entry : left)
      kept.push_back(entry.key.kind != ConstraintKey::none);
    return kept;
  }
};

constexpr std::array<float, 3> up = {0, 1, 0}, down = {0, -1, 0}, aside = {1, 0, 0};

}  // namespace

TEST_CASE("a layer hides the layers behind it, on each side of a vertex") {
  Layers layers({{0, 0, 0}});
  layers.add_face({0, -2, 0}, up);
  layers.add_face({0, -1, 0}, up);
  layers.add_face({0.3, -3, 0}, up);
  layers.add_face({0, 1.5, 0}, down);
  layers.add_face({0, 4, 0}, down);
  layers.add_face({-1, 0, 0}, aside);  // a wall
  CHECK(layers.kept() == std::vector<bool>{false, true, false, true, false, true});
}

TEST_CASE("a neighbour in the same flat surface is not hidden") {
  Layers layers({{0, 0, 0}});
  layers.add_face({0, -1, 0}, up);
  layers.add_face({0.5, -1, 0}, up);
  layers.add_face({-0.5, -1.01, 0}, up);
  layers.add_face({0.5, -1.1, 0}, up);
  CHECK(layers.kept() == std::vector<bool>{true, true, true, false});
}

TEST_CASE("a layer that moves out of the way hides nothing") {
  Layers layers({{0, 0, 0}});
  layers.add_face({0, -1, 0}, up, {0, -3, 0});
  layers.add_face({0, -2, 0}, up);
  CHECK(layers.kept() == std::vector<bool>{true, true});
}

TEST_CASE("a layer that lets the next one pass, or cannot act, hides nothing") {
  Layers layers({{0, 0, 0}});
  layers.add_face({0, -1, 0}, up);
  layers.add_face({0, -2, 0}, up);
  SECTION("passes") { layers.stop_each_other = false; }
  SECTION("cannot act") { layers.estimates[0].can_act = false; }
  SECTION("was dropped") { layers.entries[0].key.kind = ConstraintKey::none; }
  CHECK(layers.kept().back());
}

TEST_CASE("an edge hides what lies behind it at the same place") {
  Layers layers({{-1, 0, 0}, {1, 0, 0}});
  layers.add({{0, -1, -1}, {0, -1, 1}}, up, 1);
  layers.add({{0.1, -2, -1}, {0.1, -2, 1}}, up, 2).u = 0.55F;
  layers.add({{0.9, -1.5, -1}, {0.9, -1.5, 1}}, up, 1.5).u = 0.95F;
  CHECK(layers.kept() == std::vector<bool>{true, false, true});
}

TEST_CASE("a face that many vertices are near sees a few of them") {
  constexpr int count = 20000;
  Layers layers({{0, 0, 0}});
  for (int i = 0; i < count; ++i) {
    Contact& contact = layers.add_face({0, -1, 0}, up);
    contact.primitive_a = 1 + i;  // vertices beside each other
    contact.primitive_b = 0;
    contact.vertices[0] = layers.add_vertices({{0.001 * i, 0, 0}});
    layers.entries.back().gap = 1 + 1e-6 * i;
  }
  const std::vector<bool> kept = layers.kept();  // in no time
  CHECK(std::count(kept.begin(), kept.end(), true) > count / 2);
  CHECK(layers.kept(3) == kept);
}

TEST_CASE("pages within each other's margins have few contacts, and none passes") {
  const World kind = GENERATE(World::rigid, World::deformable);
  CAPTURE(kind == World::rigid);
  scenes::WorldOptions options = quiet_options(kind, 1.0 / 60);
  options.gravity = 10;
  options.margin = 0.25;
  const auto world = PhysicsWorld::make(options);
  constexpr int pages = 10, nodes = 7;
  std::vector<const btSoftBody*> bodies;
  for (int i = 0; i < pages; ++i) {
    auto page = sheet(*world, nodes, 0.5, 0.02 * i);
    for (int k = 0; k < nodes; ++k) page->setMass(k, 0);
    page->addVelocity(btVector3(0, btScalar(0.1) * static_cast<btScalar>(pages - i), 0));
    bodies.push_back(page.get());
    world->add(std::move(page));
  }
  const int steps = is_sanitized ? 10 : 60;
  for (int i = 0; i < steps; ++i) world->step();
  for (int i = 0; i + 1 < pages; ++i)
    CHECK(bodies[i + 1]->m_nodes[nodes * nodes / 2].m_x.y() >
          bodies[i]->m_nodes[nodes * nodes / 2].m_x.y());
  // With all near pairs it was 40 for each node.
  CHECK(world->total_stats()->contact_rows < 15 * steps * pages * nodes * nodes);
  CHECK(world->total_stats()->failsafe_holds == 0);
}
