// The detections of a step, through the solvers.
#include <vector>

#include "plugin/support/worlds.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// Positions of all nodes after an impact. The sheets meet so fast that the response moves nodes by
// more than the thickness, so near pairs alone do not suffice.
std::vector<btScalar> ends_of_impact(const scenes::WorldOptions& options) {
  Impact impact(options);
  impact.steps(24);
  REQUIRE(impact.world->total_stats()->contacts_vf > 0);
  std::vector<btScalar> ends;
  for (const btSoftBody* body : {impact.held, impact.thrown}) {
    for (int i = 0; i < body->m_nodes.size(); ++i) {
      for (int k = 0; k < 3; ++k) ends.push_back(body->m_nodes[i].m_x[k]);
    }
  }
  return ends;
}

}  // namespace

TEST_CASE("separation and reduce_contacts of the application change nothing") {
  scenes::WorldOptions options = quiet_options(GENERATE(World::rigid, World::deformable));
  const std::vector<btScalar> ends = ends_of_impact(options);
  options.lazyccd.detector.separation = 0.05;
  const bool same_with_separation = ends_of_impact(options) == ends;
  CHECK(same_with_separation);
  options.lazyccd.detector.separation = 0;
  options.lazyccd.detector.reduce_contacts = true;
  const bool same_with_reduction = ends_of_impact(options) == ends;
  CHECK(same_with_reduction);
}
