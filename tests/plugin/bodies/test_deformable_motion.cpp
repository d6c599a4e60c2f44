// In the deformable world, Bullet's own part of a step gives the same bits as with Bullet's solver,
// on any number of threads.
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>

#include "plugin/bodies/bullet_twin.h"
#include "plugin/support/tetrahedra.h"
#include "scenes/meshes/cloth.h"
#include "scenes/meshes/solid.h"

using namespace lazyccd;
using namespace lazyccd::test;

namespace {

// An application's own force: a wind that brakes.
class Wind : public btDeformableGravityForce {
 public:
  Wind() : btDeformableGravityForce(btVector3(1, 0, 2)) {}
  void addScaledDampingForceDifferential(btScalar scale, const TVStack& dv, TVStack& df) override {
    for (int b = 0; b < m_softBodies.size(); ++b) {
      for (int i = 0; i < m_softBodies[b]->m_nodes.size(); ++i) {
        const int index = m_softBodies[b]->m_nodes[i].index;
        df[index] -= scale * btScalar(0.001) * dv[index];
      }
    }
  }
};

enum class Springs { along, all_directions, undamped };

void build(DeformableTwin& twin, Springs springs, bool has_wind, bool has_solids) {
  std::mt19937 random(3);
  std::vector<btSoftBody*> cloths, solids;
  for (int i = 0; i < 4; ++i) {
    scenes::Sheet s{24 + i, 32, 1, 1};
    s.jitter = 0.01;
    s.height = 3.0 * i;
    cloths.push_back(twin.add(scenes::make_sheet(twin.info(), s, random)));
    cloths.back()->setVelocity(btVector3(btScalar(i), 1, 0));
  }
  cloths[0]->setMass(0, 0);
  cloths[0]->setMass(23, 0);
  cloths[2]->m_cfg.drag = btScalar(0.01);
  for (int i = 0; i < 3 && has_solids; ++i) {
    const btVector3 centre(5, btScalar(3 * i), 0);
    solids.push_back(twin.add(scenes::make_ball(twin.info(), 4, 1, centre, 0.5)));
    orient_tetrahedra(*solids.back());
    solids.back()->setVelocity(btVector3(0, 0, 1));
    solids.back()->addVelocity(btVector3(0, 4, 0), 3);
  }
  if (has_solids) {
    twin.make(std::make_unique<btDeformableLinearElasticityForce>(btScalar(1), btScalar(1),
                                                                  btScalar(0.02), btScalar(0.03)),
              {solids[0], solids[1]});
    twin.make(std::make_unique<btDeformableNeoHookeanForce>(btScalar(1), btScalar(1)), {solids[2]});
  }
  // Two forces act on some of the bodies. One body has the springs twice.
  cloths.insert(cloths.end(), solids.begin(), solids.end());
  cloths.push_back(cloths[3]);
  const btScalar damping = springs == Springs::undamped ? btScalar(0) : btScalar(0.1);
  twin.make(std::make_unique<btDeformableMassSpringForce>(2, damping, springs == Springs::along),
            cloths);
  cloths.pop_back();
  if (!has_wind)
    twin.make(std::make_unique<btDeformableGravityForce>(btVector3(0, -10, 0)), cloths);
  if (has_wind) twin.make(std::make_unique<Wind>(), cloths);
}

}  // namespace

TEST_CASE("the deformable world without contacts has the bits of Bullet's solver") {
  const int threads = GENERATE(1, 2, 3);
  const Springs springs = GENERATE(Springs::along, Springs::all_directions, Springs::undamped);
  const bool has_wind = springs == Springs::all_directions, has_solids = GENERATE(false, true);
  CAPTURE(threads, static_cast<int>(springs), has_wind, has_solids);
  DeformableTwin bullets(0), lazy(threads);
  build(bullets, springs, has_wind, has_solids);
  build(lazy, springs, has_wind, has_solids);
  check_steps(bullets, lazy, 12, [](TwinWorld& world, int step) {
    std::vector<std::unique_ptr<btSoftBody>>& bodies = world.bodies;
    if (step == 3) bodies[2]->addVelocity(btVector3(1, 0, 0), 7);
    if (step == 5) bodies[1]->setMass(9, 3);
    if (step == 7) {
      world.world().removeCollisionObject(bodies[2].get());
      bodies.erase(bodies.begin() + 2);
    }
    if (step == 8) bodies[0]->forceActivationState(DISABLE_SIMULATION);
    if (step == 10) bodies[0]->forceActivationState(ACTIVE_TAG);
  });
  CHECK(lazy.lazy.total_stats().contacts_vf == 0);
  CHECK(lazy.lazy.total_stats().fallback_steps == 0);
}

// Bullet's solver keeps the predicted position of an anchored node in m_q; LazyCCD does not.
TEST_CASE("anchored deformable bodies move alike on any number of threads") {
  const int threads = GENERATE(2, 3);
  CAPTURE(threads);
  DeformableTwin one(1), several(threads);
  for (DeformableTwin* twin : {&one, &several}) {
    build(*twin, Springs::along, false, true);
    for (int i = 0; i < 3; ++i) {
      btSoftBody& body = *twin->bodies[static_cast<std::size_t>(i)];
      const btVector3 place = body.m_nodes[5].m_x + btVector3(0, 10, 9);
      body.appendDeformableAnchor(
          5, twin->add_rigid(std::make_unique<btBoxShape>(btVector3(1, 1, 1)), place, 2));
    }
  }
  check_steps(one, several, 12);
}

TEST_CASE("implicit steps and steps with projections stay with Bullet's solver") {
  const bool is_implicit = GENERATE(false, true);
  const int threads = GENERATE(1, 3);
  CAPTURE(is_implicit, threads);
  DeformableTwin bullets(0), lazy(threads);
  for (DeformableTwin* twin : {&bullets, &lazy}) {
    twin->dynamics->setImplicit(is_implicit);
    twin->dynamics->setUseProjection(true);
    std::vector<btSoftBody*> balls;
    for (int i = 0; i < 3; ++i) {
      const btVector3 centre(0, btScalar(3 * i), 0);
      balls.push_back(twin->add(scenes::make_ball(twin->info(), 9, 1, centre, 0.5)));
      balls.back()->setVelocity(btVector3(0, 0, 1));
    }
    twin->make(std::make_unique<btDeformableLinearElasticityForce>(btScalar(1), btScalar(1),
                                                                   btScalar(0), btScalar(0.03)),
               balls);
  }
  check_steps(bullets, lazy, 6);
  CHECK(lazy.lazy.total_stats().contacts_vf == 0);
}
