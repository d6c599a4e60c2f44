#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "models/model.h"
#include "support/catch.h"

using namespace lazyccd;

namespace {

Detector detector_of(const models::Model& model, DetectorOptions options = {}) {
  options.backend = Backend::cpu;
  options.threads = 2;
  Detector detector(options);
  detector.set_topology(model.topology());
  return detector;
}

void step(Detector& detector, const models::Model& model, int frame) {
  const std::vector<float> from = model.frame(frame), to = model.frame(frame + 1);
  detector.detect({from.data(), model.vertex_count()}, {to.data(), model.vertex_count()});
}

}  // namespace

TEST_CASE("each model is made by its name, moves, and is the same for the same seed") {
  for (const models::ModelName& named : models::model_names()) {
    CAPTURE(named.name);
    const auto model = models::make_model(named.name), again = models::make_model(named.name);
    const auto other = models::make_model(named.name, 2);
    const std::vector<float> start = model->frame(0), later = model->frame(50);
    REQUIRE(start.size() == 3 * model->vertex_count());
    CHECK(start == again->frame(0));
    CHECK(later == again->frame(50));
    CHECK(later != other->frame(50));
    CHECK(start != later);
    for (const float x : later)
      if (!(std::fabs(x) < 10)) FAIL("a position is out of bounds");
  }
  CHECK_THROWS_AS(models::make_model("cow"), Error);
}

TEST_CASE("models have the dissertation's numbers of triangles") {
  const auto triangles = [](const char* name) { return models::make_model(name)->faces().size(); };
  CHECK(triangles("cloud-64") == 64);
  CHECK(triangles("cloud-1024") == 1024);
  CHECK(triangles("funnel") == 18'432);
  CHECK(triangles("cloth-ball") == 92'018);
  CHECK(triangles("n-body") == 146'560);
}

TEST_CASE("mean fronts of the triangle clouds agree with the dissertation within a fifth") {
  struct Front {
    const char* model;
    double nodes;
    int every;  // only every so many steps are detected
  };
  // The largest front, 2.16 M nodes, takes a minute and is left out.
  for (const Front& front :
       {Front{"cloud-64", 808, 1}, Front{"cloud-256", 9160, 5}, Front{"cloud-1024", 127'000, 20}}) {
    const auto model = models::make_model(front.model);
    Detector detector = detector_of(*model);
    double sum = 0;
    int steps = 0;
    for (int f = 0; f + 1 < models::Model::frames; f += front.every, ++steps) {
      step(detector, *model, f);
      sum += static_cast<double>(detector.stats().front_nodes);
    }
    CAPTURE(front.model, sum / steps);
    CHECK(std::fabs(sum / steps - front.nodes) < 0.2 * front.nodes);
  }
}

TEST_CASE("strategies, volumes and culling give the same contacts on models") {
  for (const char* name : {"cloud-256", "funnel"}) {
    const auto model = models::make_model(name);
    std::uint64_t expected = 0;
    const auto check = [&](const DetectorOptions& options) {
      Detector detector = detector_of(*model, options);
      step(detector, *model, 70);
      CHECK(detector.stats().contacts_ee > 0);
      if (expected == 0) expected = detector.stats().hash;
      CHECK(detector.stats().hash == expected);
    };
    for (const Strategy strategy : kStrategies) {
      DetectorOptions options;
      options.algorithm.strategy = strategy;
      check(options);
    }
    for (const Volume volume : kVolumes) {
      DetectorOptions options;
      options.algorithm.volume = volume;
      options.algorithm.culling = {false, true, true};
      check(options);
    }
  }
}
