// Edges that a topology takes from the last one are those that are found without it.
#include <algorithm>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

#include "host/scene/kept_edges.h"
#include "host/scene/mesh.h"
#include "lazyccd/error.h"
#include "support/build_scenes.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// A body with its own numbers of vertices.
struct OwnBody {
  std::int32_t vertices = 0;
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<float> inverse_mass;
};

// All bodies in one index space, without positions.
struct AllBodies : BuildScene {
  std::vector<char> pinned;
  std::size_t body_count = 0;

  explicit AllBodies(const std::vector<OwnBody>& own) : body_count(own.size()) {
    for (std::size_t b = 0; b < own.size(); ++b) {
      const auto first = static_cast<std::int32_t>(body_of_vertex.size());
      for (Face face : own[b].faces) {
        for (std::int32_t& v : face) v += first;
        faces.push_back(face);
      }
      for (const Edge& edge : own[b].edges) edges.push_back({edge[0] + first, edge[1] + first});
      for (const float mass : own[b].inverse_mass) {
        add_vertex(0, 0, 0, static_cast<std::int32_t>(b));
        inverse_mass.push_back(mass);
        pinned.push_back(mass == 0);
      }
    }
  }
  EdgeInput input() const { return {body_of_vertex, body_count, faces, edges, pinned}; }
  EdgeTable table(ThreadPool& pool) const {
    EdgeTable table;
    table.build(body_of_vertex.size(), faces, edges, pinned, pool);
    return table;
  }
};

OwnBody random_body(std::mt19937& random) {
  const auto up_to = [&random](int most) { return static_cast<std::int32_t>(random() % most); };
  OwnBody body;
  body.vertices = 4 + up_to(40);
  for (std::int32_t v = 0; v < body.vertices; ++v)
    body.inverse_mass.push_back(up_to(3) == 0 ? 0.0f : 1.0f);
  const auto other = [&](std::int32_t v, std::int32_t step) { return (v + step) % body.vertices; };
  std::set<Face> known;
  const auto add_face = [&](const Face& face) {
    Face sorted = face;
    std::sort(sorted.begin(), sorted.end());
    if (known.insert(sorted).second) body.faces.push_back(face);
  };
  for (std::int32_t v = 0; v < body.vertices; ++v) {
    if (up_to(3) > 0) add_face({v, other(v, 1), other(v, 2)});
    if (up_to(4) == 0) add_face({other(v, 3), v, other(v, 1)});
    if (up_to(5) == 0) body.edges.push_back({v, other(v, 1 + up_to(3))});
  }
  add_face({0, 1, 3});
  std::shuffle(body.faces.begin(), body.faces.end(), random);
  return body;
}

// Adds, removes, replaces or swaps bodies, or pins a vertex.
void change(std::vector<OwnBody>& bodies, std::mt19937& random) {
  const auto place = [&] {
    return bodies.begin() + static_cast<std::ptrdiff_t>(random() % bodies.size());
  };
  switch (random() % 6) {
    case 0:
      bodies.insert(place(), random_body(random));
      break;
    case 1:
      bodies.push_back(random_body(random));
      break;
    case 2:
      bodies.erase(place());
      break;
    case 3:
      *place() = random_body(random);
      break;
    case 4:
      std::iter_swap(place(), place());
      break;
    default: {
      OwnBody& body = *place();
      body.inverse_mass[random() % body.inverse_mass.size()] = 0;
    }
  }
}

template <class List>
bool are_equal(const List& a, const List& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

bool are_equal_tables(const EdgeTable& a, const EdgeTable& b) {
  return are_equal(a.edges, b.edges) && are_equal(a.free_edges, b.free_edges) &&
         are_equal(a.face_edges, b.face_edges) && are_equal(a.first_faces, b.first_faces) &&
         a.has_duplicate_faces == b.has_duplicate_faces;
}

std::vector<OwnBody> random_bodies(int count, std::mt19937& random) {
  std::vector<OwnBody> bodies;
  for (int i = 0; i < count; ++i) bodies.push_back(random_body(random));
  return bodies;
}

}  // namespace

TEST_CASE("edges of bodies that stay are those that are found anew", "[threads]") {
  for (const int threads : {1, 3}) {
    ThreadPool pool(threads);
    std::mt19937 random(5);
    for (int run = 0; run < 20; ++run) {
      std::vector<OwnBody> bodies = random_bodies(24, random);
      for (int step = 0; step < 20; ++step) {
        const AllBodies last(bodies);
        const int changes = 1 + static_cast<int>(random() % 3);
        for (int i = 0; i < changes; ++i) change(bodies, random);
        const AllBodies now(bodies);
        INFO("threads " << threads << ", run " << run << ", step " << step);
        EdgeTable table;
        REQUIRE(build_with_kept_edges(now.input(), last.input(), last.table(pool), table, pool));
        CHECK(are_equal_tables(table, now.table(pool)));
      }
    }
  }
}

TEST_CASE("edges are not kept where most bodies are new or their order is another", "[threads]") {
  ThreadPool pool(2);
  std::mt19937 random(6);
  std::vector<OwnBody> bodies = random_bodies(24, random);
  const AllBodies last(bodies);
  const EdgeTable last_table = last.table(pool);
  EdgeTable table;
  const auto keeps = [&](const AllBodies& now) {
    return build_with_kept_edges(now.input(), last.input(), last_table, table, pool);
  };
  CHECK(keeps(last));
  AllBodies other_order = last;
  std::swap(other_order.faces.front(), other_order.faces.back());
  CHECK(!keeps(other_order));
  std::reverse(bodies.begin(), bodies.end());
  CHECK(keeps(AllBodies(bodies)));
  bodies.erase(bodies.begin(), bodies.begin() + 20);
  CHECK(keeps(AllBodies(bodies)));
  CHECK(!keeps(AllBodies(random_bodies(24, random))));
}

TEST_CASE("a duplicate face of a new body is found beside bodies that stay", "[threads]") {
  ThreadPool pool(2);
  std::mt19937 random(9);
  std::vector<OwnBody> bodies = random_bodies(8, random);
  const Mesh last(AllBodies(bodies).topology(), pool);
  bodies[3].faces.push_back(bodies[3].faces[0]);
  const AllBodies now(bodies);
  try {
    Mesh(now.topology(), pool, nullptr, &last);
    FAIL("no error");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::duplicate_face);
    CHECK(error.body() == 3);
  }
}
