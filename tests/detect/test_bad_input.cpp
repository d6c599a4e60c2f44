// Bad input is refused with an error that names the body and the primitive. The detector then still
// works.
#include <functional>
#include <limits>
#include <vector>

#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "support/catch.h"

using namespace lazyccd;

namespace {

// Two bodies of one triangle each. Vertex 3 of the upper one falls through the lower one and meets
// it at half of the step.
struct Scene {
  std::vector<double> start = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.25, 0.25, 0.125, 2, 2, 3, 2, 3, 3};
  std::vector<double> end = start;
  std::vector<Face> faces = {{0, 1, 2}, {3, 4, 5}};
  std::vector<Edge> edges;
  std::vector<std::int32_t> body_of_vertex = {0, 0, 0, 1, 1, 1};
  std::vector<float> inverse_mass = std::vector<float>(6, 1.0f);
  std::vector<Body> bodies = {{}, {}};
  std::vector<BodyPair> disabled_pairs;

  Scene() { end[11] = -0.125; }

  Topology topology() const {
    Topology result;
    result.vertex_count = start.size() / 3;
    result.faces = faces;
    result.edges = edges;
    result.body_of_vertex = body_of_vertex;
    result.inverse_mass = inverse_mass;
    result.bodies = bodies;
    result.disabled_pairs = disabled_pairs;
    return result;
  }
};

Positions positions(const std::vector<double>& xyz) { return {xyz.data(), xyz.size() / 3}; }

DetectorOptions cpu_options() {
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.threads = 2;
  return options;
}

std::size_t count_contacts(Detector& detector, const Scene& scene) {
  return detector.detect(positions(scene.start), positions(scene.end)).size();
}

struct Fault {
  ErrorCode code;
  std::int32_t body, primitive;
};

// Sets a good topology and checks that `action` throws the expected error. Then checks that the
// detector still works.
void check_fault(const Fault& expected, const std::function<void(Detector&)>& action) {
  const Scene good;
  Detector detector(cpu_options());
  detector.set_topology(good.topology());
  try {
    action(detector);
    FAIL("bad input was accepted");
  } catch (const Error& error) {
    CAPTURE(error.what());
    CHECK(error.code() == expected.code);
    CHECK(error.body() == expected.body);
    CHECK(error.primitive() == expected.primitive);
    CHECK(std::string(error.what()).size() > 10);
  }
  CHECK(count_contacts(detector, good) == 1);
}

void check_topology_fault(const Fault& expected, const std::function<void(Scene&)>& spoil) {
  Scene bad;
  spoil(bad);
  check_fault(expected, [&](Detector& detector) { detector.set_topology(bad.topology()); });
}

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

}  // namespace

TEST_CASE("a position that is not finite is refused with its vertex and body, at either end") {
  for (const double value : {not_a_number, infinity, -infinity}) {
    for (const bool at_end : {false, true}) {
      for (const std::size_t vertex : {0, 2, 3, 5}) {
        const Fault expected = {ErrorCode::non_finite_position, vertex < 3 ? 0 : 1,
                                static_cast<std::int32_t>(vertex)};
        check_fault(expected, [&](Detector& detector) {
          Scene bad;
          (at_end ? bad.end : bad.start)[3 * vertex + 1] = value;
          count_contacts(detector, bad);
        });
      }
    }
  }
}

TEST_CASE("a position in single precision that is not finite is refused") {
  check_fault({ErrorCode::non_finite_position, 1, 4}, [](Detector& detector) {
    std::vector<float> xyz(18, 0.0f);
    xyz[3 * 4] = std::numeric_limits<float>::infinity();
    detector.detect({xyz.data(), 6}, {xyz.data(), 6});
  });
}

TEST_CASE("a number of positions that differs from the number of vertices is refused") {
  check_fault({ErrorCode::size_mismatch, -1, -1}, [](Detector& detector) {
    const Scene scene;
    detector.detect({scene.start.data(), 5}, positions(scene.end));
  });
  check_fault({ErrorCode::size_mismatch, -1, -1}, [](Detector& detector) {
    const Scene scene;
    detector.detect(positions(scene.start), {scene.end.data(), 5});
  });
}

TEST_CASE("an index outside its table is refused with the face, edge or vertex") {
  check_topology_fault({ErrorCode::index_out_of_range, 1, 1}, [](Scene& s) {
    s.faces[1] = {3, 4, 6};
  });
  check_topology_fault({ErrorCode::index_out_of_range, 1, 1}, [](Scene& s) {
    s.faces[1] = {3, -1, 5};
  });
  check_topology_fault({ErrorCode::index_out_of_range, 0, 0}, [](Scene& s) { s.edges = {{0, 6}}; });
  check_topology_fault({ErrorCode::index_out_of_range, 2, 5},
                       [](Scene& s) { s.body_of_vertex[5] = 2; });
  check_topology_fault({ErrorCode::index_out_of_range, -1, 4},
                       [](Scene& s) { s.body_of_vertex[4] = -1; });
  check_topology_fault({ErrorCode::index_out_of_range, 2, 0}, [](Scene& s) {
    s.disabled_pairs = {{0, 2}};
  });
}

TEST_CASE("a face or edge that names a vertex twice is refused") {
  check_topology_fault({ErrorCode::degenerate_face, 1, 1}, [](Scene& s) {
    s.faces[1] = {3, 4, 4};
  });
  check_topology_fault({ErrorCode::degenerate_face, 0, 0}, [](Scene& s) {
    s.faces[0] = {2, 1, 2};
  });
  check_topology_fault({ErrorCode::degenerate_face, 1, 0}, [](Scene& s) { s.edges = {{4, 4}}; });
}

TEST_CASE("a duplicate face is refused in any order of its corners") {
  for (const Face& again : {Face{0, 1, 2}, Face{1, 2, 0}, Face{2, 1, 0}}) {
    check_topology_fault({ErrorCode::duplicate_face, 0, 2},
                         [&](Scene& s) { s.faces.push_back(again); });
  }
}

TEST_CASE("a face or edge across two bodies is refused") {
  check_topology_fault({ErrorCode::mixed_body, 0, 0}, [](Scene& s) { s.faces[0] = {0, 1, 3}; });
  check_topology_fault({ErrorCode::mixed_body, 1, 0}, [](Scene& s) { s.edges = {{3, 0}}; });
}

TEST_CASE("a body without a face or an edge is refused") {
  check_topology_fault({ErrorCode::empty_body, 1, -1}, [](Scene& s) { s.faces.pop_back(); });
  check_topology_fault({ErrorCode::empty_body, 2, -1}, [](Scene& s) { s.bodies.push_back({}); });
}

TEST_CASE("tables whose lengths do not fit together are refused") {
  check_topology_fault({ErrorCode::size_mismatch, -1, -1},
                       [](Scene& s) { s.body_of_vertex.pop_back(); });
  check_topology_fault({ErrorCode::size_mismatch, -1, -1},
                       [](Scene& s) { s.inverse_mass.push_back(1); });
}

TEST_CASE("non-manifold edges, ropes and repeated edges are accepted") {
  Scene scene;
  // Adds a third and a fourth face at the edge (0, 1), and an edge of body 1 without a face.
  scene.start.insert(scene.start.end(), {0.5, -1, 0, 0.5, 0, -1, 3, 3, 3});
  scene.end.insert(scene.end.end(), {0.5, -1, 0, 0.5, 0, -1, 3, 3, 3});
  scene.faces.push_back({1, 0, 6});
  scene.faces.push_back({0, 1, 7});
  scene.edges = {{5, 8}, {8, 5}, {0, 1}};
  scene.body_of_vertex.insert(scene.body_of_vertex.end(), {0, 0, 1});
  scene.inverse_mass.resize(9, 1.0f);
  Detector detector(cpu_options());
  detector.set_topology(scene.topology());
  CHECK(detector.edges().size() == 3 + 3 + 2 + 2 + 1);
  CHECK(count_contacts(detector, scene) == 1);
}

TEST_CASE("options outside their range are refused") {
  const auto code_of = [](const DetectorOptions& options) {
    try {
      Detector detector(options);
    } catch (const Error& error) {
      return error.code();
    }
    return ErrorCode::device;
  };
  const auto spoilt = [&](const std::function<void(DetectorOptions&)>& spoil) {
    DetectorOptions options = cpu_options();
    spoil(options);
    return code_of(options);
  };
  CHECK(spoilt([](DetectorOptions& o) { o.threads = -1; }) == ErrorCode::invalid_argument);
  CHECK(spoilt([](DetectorOptions& o) { o.algorithm.front_period = 0; }) ==
        ErrorCode::invalid_argument);
  CHECK(spoilt([](DetectorOptions& o) { o.algorithm.front_ratio = not_a_number; }) ==
        ErrorCode::invalid_argument);
  CHECK(spoilt([](DetectorOptions& o) { o.algorithm.rebuild_ratio = not_a_number; }) ==
        ErrorCode::invalid_argument);
  CHECK(spoilt([](DetectorOptions& o) { o.algorithm.rebuild_ratio = -1; }) ==
        ErrorCode::invalid_argument);
}

TEST_CASE("an empty scene has no contacts") {
  Detector detector(cpu_options());
  detector.set_topology({});
  CHECK(detector
            .detect({static_cast<const double*>(nullptr), 0},
                    {static_cast<const double*>(nullptr), 0})
            .empty());
}
