// Topologies one after another in one detector, which uses the memory of earlier ones.
#include <memory>
#include <vector>

#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "models/model.h"
#include "support/catch.h"

using namespace lazyccd;

namespace {

std::uint64_t hash_of(Detector& detector, const models::Model& model) {
  detector.set_topology(model.topology());
  const std::vector<float> start = model.frame(50), end = model.frame(51);
  detector.detect({start.data(), model.vertex_count()}, {end.data(), model.vertex_count()});
  return detector.stats().hash;
}

}  // namespace

TEST_CASE("a detector finds the same after topologies of other sizes as a new one") {
  DetectorOptions options;
  options.backend = Backend::cpu;
  const auto large = models::make_triangle_cloud(2000, 1),
             small = models::make_triangle_cloud(40, 2),
             medium = models::make_triangle_cloud(1500, 3);
  Detector detector(options);
  for (const models::Model* model : {large.get(), small.get(), large.get(), medium.get(),
                                     large.get(), small.get(), small.get(), small.get()}) {
    Detector fresh(options);
    CHECK(hash_of(detector, *model) == hash_of(fresh, *model));
    CHECK(detector.stats().faces == static_cast<std::int64_t>(model->faces().size()));
  }
  // After one that is refused the last one stays.
  const Face invalid = {0, 1, 1};
  Topology refused = small->topology();
  refused.faces = Span<const Face>(&invalid, 1);
  CHECK_THROWS_AS(detector.set_topology(refused), Error);
  for (int i = 0; i < 3; ++i) {
    Detector fresh(options);
    CHECK(hash_of(detector, *medium) == hash_of(fresh, *medium));
  }
}
