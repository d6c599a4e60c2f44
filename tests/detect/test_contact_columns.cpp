// Contacts as one array for each field.
#include <memory>
#include <vector>

#include "lazyccd/detector.h"
#include "models/model.h"
#include "support/catch.h"

using namespace lazyccd;

TEST_CASE("columns hold the fields of the contacts that were asked for, and no others") {
  const std::unique_ptr<models::Model> model = models::make_model("funnel");
  const std::vector<float> start = model->frame(40), end = model->frame(41);
  const Positions from(start.data(), model->vertex_count()), to(end.data(), model->vertex_count());
  DetectorOptions options;
  options.backend = Backend::cpu;
  Detector whole(options), parts(options);
  for (Detector* detector : {&whole, &parts}) detector->set_topology(model->topology());
  const Span<const Contact> all = whole.detect(from, to);
  REQUIRE(all.size() % 4 != 0);  // so that there is padding between the columns
  for (std::uint32_t fields = 0; fields < 128; ++fields) {
    const ContactColumns c = parts.detect_columns(from, to, fields);
    CHECK(c.count == all.size());
    CHECK(parts.stats().hash == whole.stats().hash);
    const auto size = [&](ContactField field) { return fields & field ? all.size() : 0; };
    REQUIRE(c.kind.size() == size(kKindField));
    REQUIRE(c.bodies.size() == size(kBodiesField));
    REQUIRE(c.primitives.size() == size(kPrimitivesField));
    REQUIRE(c.vertices.size() == size(kVerticesField));
    REQUIRE(c.point.size() == size(kPointField));
    REQUIRE(c.normal.size() == size(kNormalField));
    REQUIRE(c.toi.size() == size(kTimeField));
    bool same = true;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Contact& x = all[i];
      same = same && (c.kind.empty() || c.kind[i] == x.kind);
      same = same && (c.bodies.empty() || c.bodies[i] == std::array{x.body_a, x.body_b});
      same = same &&
             (c.primitives.empty() || c.primitives[i] == std::array{x.primitive_a, x.primitive_b});
      same = same && (c.vertices.empty() || c.vertices[i] == x.vertices);
      same = same && (c.point.empty() || c.point[i] == std::array{x.u, x.v});
      same = same && (c.normal.empty() || c.normal[i] == x.normal);
      same = same && (c.toi.empty() || c.toi[i] == x.toi);
    }
    CHECK(same);
  }
  CHECK(parts.take_contacts().empty());
}
