// The systems into which the momentum equation falls apart.
#include "bodies/equation_islands.h"

#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <array>
#include <memory>
#include <vector>

#include "bodies/conjugate_residual.h"
#include "support/catch.h"
#include "util/scratch_vector.h"

using namespace lazyccd;
using namespace lazyccd::bullet;

namespace {

// Ropes of three nodes. Bullet numbers the nodes of all in order.
struct Ropes {
  btSoftBodyWorldInfo info;
  std::vector<std::unique_ptr<btSoftBody>> ropes;
  btAlignedObjectArray<btSoftBody*> bodies;
  VectorStack backup;
  std::unique_ptr<btDeformableBackwardEulerObjective> objective;

  explicit Ropes(int count) {
    for (int i = 0; i < count; ++i) {
      ropes.emplace_back(btSoftBodyHelpers::CreateRope(info, btVector3(0, btScalar(i), 0),
                                                       btVector3(1, btScalar(i), 0), 1, 0));
      bodies.push_back(ropes.back().get());
    }
    objective = std::make_unique<btDeformableBackwardEulerObjective>(bodies, backup);
  }
  int nodes() const { return 3 * bodies.size(); }
  // A multiplier of these nodes.
  void connect(int a, int b) {
    LagrangeMultiplier multiplier = {};
    multiplier.m_num_nodes = 2;
    multiplier.m_indices[0] = a;
    multiplier.m_indices[1] = b;
    objective->m_projection.m_lagrangeMultipliers.push_back(multiplier);
  }
  ScratchVector<EquationIsland> islands(const std::vector<std::array<int, 2>>& pairs) const {
    return find_equation_islands(*objective, nodes(), pairs);
  }
};

}  // namespace

TEST_CASE("bodies that contacts or multipliers connect are one island of the momentum equation") {
  Ropes ropes(6);
  ropes.connect(4, 10);  // bodies 1 and 3
  ropes.connect(15, 16);
  const ScratchVector<EquationIsland> islands = ropes.islands({{0, 0}, {2, 3}});
  REQUIRE(islands.size() == 3);
  CHECK(islands[0].bodies == ScratchVector<int>{0});
  CHECK(islands[0].unknowns == ScratchVector<int>{0, 1, 2});
  CHECK(islands[0].multipliers().empty());
  CHECK(islands[1].bodies == ScratchVector<int>{1, 2, 3});
  CHECK(islands[1].unknowns == ScratchVector<int>{3, 4, 5, 6, 7, 8, 9, 10, 11, 18});
  CHECK(islands[1].node_count == 9);
  // What no contact touches.
  CHECK(islands[2].bodies == ScratchVector<int>{4, 5});
  CHECK(islands[2].unknowns == ScratchVector<int>{12, 13, 14, 15, 16, 17, 19});
}

TEST_CASE("the momentum equation is not divided if a link joins two bodies") {
  Ropes ropes(2);
  ropes.ropes[0]->appendLink(&ropes.ropes[0]->m_nodes[0], &ropes.ropes[1]->m_nodes[0]);
  const ScratchVector<EquationIsland> islands = ropes.islands({{0, 0}});
  REQUIRE(islands.size() == 1);
  CHECK(islands[0].bodies == ScratchVector<int>{0, 1});
  CHECK(islands[0].unknowns.size() == 6);
}
