// A mesh that takes the edges of bodies from an earlier one has the edges of one that does not.
#include <algorithm>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

#include "cpu/scene/mesh.h"
#include "lazyccd/error.h"
#include "support/catch.h"

using namespace lazyccd;

namespace {

// A body with its own numbers of vertices.
struct OwnBody {
  std::int32_t vertices = 0;
  std::vector<Face> faces;
  std::vector<Edge> edges;
  std::vector<float> inverse_mass;
};

struct Bodies {
  std::vector<OwnBody> all;

  // The mesh of all bodies, which takes edges from `last`.
  Mesh mesh(ThreadPool& pool, const Mesh* last) const {
    std::vector<Face> faces;
    std::vector<Edge> edges;
    std::vector<std::int32_t> body_of_vertex;
    std::vector<float> inverse_mass;
    for (std::size_t b = 0; b < all.size(); ++b) {
      const auto first = static_cast<std::int32_t>(body_of_vertex.size());
      for (Face face : all[b].faces) {
        for (std::int32_t& v : face) v += first;
        faces.push_back(face);
      }
      for (const Edge& edge : all[b].edges) edges.push_back({edge[0] + first, edge[1] + first});
      body_of_vertex.insert(body_of_vertex.end(), static_cast<std::size_t>(all[b].vertices),
                            static_cast<std::int32_t>(b));
      inverse_mass.insert(inverse_mass.end(), all[b].inverse_mass.begin(),
                          all[b].inverse_mass.end());
    }
    Topology topology;
    topology.vertex_count = body_of_vertex.size();
    topology.faces = faces;
    topology.edges = edges;
    topology.body_of_vertex = body_of_vertex;
    topology.inverse_mass = inverse_mass;
    return Mesh(topology, pool, nullptr, last);
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

// Adds, removes, replaces or swaps a few bodies, or pins a vertex.
void change(Bodies& bodies, std::mt19937& random) {
  std::vector<OwnBody>& all = bodies.all;
  const auto place = [&] {
    return all.begin() + static_cast<std::ptrdiff_t>(random() % all.size());
  };
  switch (random() % 6) {
    case 0:
      all.insert(place(), random_body(random));
      break;
    case 1:
      all.push_back(random_body(random));
      break;
    case 2:
      all.erase(place());
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

bool have_equal_edges(const Mesh& a, const Mesh& b) {
  const auto first_faces = [](const Mesh& mesh) {
    std::vector<std::int32_t> faces;
    for (std::size_t e = 0; e < mesh.edge_count(); ++e) faces.push_back(mesh.first_faces().of[e]);
    return faces;
  };
  return are_equal(a.edges(), b.edges()) && are_equal(a.free_edges(), b.free_edges()) &&
         are_equal(a.face_edges(), b.face_edges()) && first_faces(a) == first_faces(b);
}

}  // namespace

TEST_CASE("edges of bodies that stay are those that are found anew", "[threads]") {
  for (const int threads : {1, 3}) {
    ThreadPool pool(threads);
    std::mt19937 random(5);
    for (int run = 0; run < 20; ++run) {
      Bodies bodies;
      for (int b = 0; b < 24; ++b) bodies.all.push_back(random_body(random));
      Mesh last = bodies.mesh(pool, nullptr);
      for (int step = 0; step < 20; ++step) {
        const int changes = 1 + static_cast<int>(random() % 3);
        for (int i = 0; i < changes; ++i) change(bodies, random);
        Mesh mesh = bodies.mesh(pool, &last);
        INFO("threads " << threads << ", run " << run << ", step " << step);
        CHECK(have_equal_edges(mesh, bodies.mesh(pool, nullptr)));
        last = std::move(mesh);
      }
    }
  }
}

TEST_CASE("a duplicate face of a new body is found beside bodies that stay", "[threads]") {
  ThreadPool pool(2);
  std::mt19937 random(9);
  Bodies bodies;
  for (int b = 0; b < 8; ++b) bodies.all.push_back(random_body(random));
  const Mesh last = bodies.mesh(pool, nullptr);
  bodies.all[3].faces.push_back(bodies.all[3].faces[0]);
  try {
    bodies.mesh(pool, &last);
    FAIL("no error");
  } catch (const Error& error) {
    CHECK(error.code() == ErrorCode::duplicate_face);
    CHECK(error.body() == 3);
  }
}
