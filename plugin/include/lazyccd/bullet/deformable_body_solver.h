// The solver for deformable bodies in btDeformableMultiBodyDynamicsWorld. An application changes
// one line:
//
//   lazyccd::bullet::btLazyDeformableBodySolver solver;
//   btDeformableMultiBodyDynamicsWorld world(dispatcher, broadphase, constraints, config, &solver);
//
// Bullet's world also runs its own continuous detection and uses none of the result.
// btLazyDeformableMultiBodyDynamicsWorld (deformable_world.h) skips it.
#pragma once

#include <BulletSoftBody/btDeformableBodySolver.h>

#include <memory>
#include <string>
#include <vector>

#include "lazyccd/bullet/debug_draw.h"
#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/pair_handler.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/export.h"
#include "lazyccd/span.h"

class btIDebugDraw;
class btMultiBodyDynamicsWorld;

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class BodyForces;
class ExpectedContacts;
class MomentumEquation;
class Normals;
class Pipeline;
class SideBySide;
class SoftBodyDbvt;

// Bullet's forces assert that the solver knows all of their bodies. So with assertions Bullet's
// solver gets the sleeping bodies too.
#if defined(DEBUG) || defined(_DEBUG) || defined(BT_DEBUG)
constexpr bool bullet_asserts = true;
#else
constexpr bool bullet_asserts = false;
#endif

/// Bullet's deformable body solver with LazyCCD's contacts. See btLazySoftBodySolver for the
/// functions that both have, and for what runs on several threads.
class LAZYCCD_BULLET_API btLazyDeformableBodySolver : public btDeformableBodySolver,
                                                      public PairHandler {
 public:
  explicit btLazyDeformableBodySolver(const SolverOptions& options = {})
      : btLazyDeformableBodySolver(options, bullet_asserts) {}
  ~btLazyDeformableBodySolver() override;
  btLazyDeformableBodySolver(const btLazyDeformableBodySolver&) = delete;
  btLazyDeformableBodySolver& operator=(const btLazyDeformableBodySolver&) = delete;

  // The following ten are as in btLazySoftBodySolver.
  Span<const StepContact> contacts() const;
  const StepStats& step_stats() const;
  const StepStats& total_stats() const;
  std::string status() const;
  std::vector<ExcludedBody> excluded_bodies() const;
  void debug_draw(btIDebugDraw& drawer, const DebugDrawOptions& options = {}) const;
  void topology_changed();
  void teleported(const btCollisionObject& body);
  void use_motors_of(btMultiBodyDynamicsWorld* world);
  static void build_trees(btSoftBody& body);

  /// False after a step that ran without LazyCCD. The next step then keeps Bullet's own handling of
  /// soft pairs.
  bool is_active() const;

  /// True for a sleeping body that this step leaves out, with Bullet's own part of the step.
  bool skips(const btSoftBody& body) const;
  bool skips_any() const { return !skipped_.empty(); }

  void handle_pair(btSoftBody* a, btSoftBody* b) override;

  void reinitialize(const btAlignedObjectArray<btSoftBody*>& softBodies, btScalar dt) override;
  void predictMotion(btScalar solverdt) override;
  void setConstraints(const btContactSolverInfo& info) override;
  void solveDeformableConstraints(btScalar solverdt) override;
  void applyExplicitForce() override;
  void setupDeformableSolve(bool implicit) override;
  void updateSoftBodies() override;
  void applyTransforms(btScalar timeStep) override;
  void processCollision(btSoftBody* body, const btCollisionObjectWrapper* other) override;
  void processCollision(btSoftBody* a, btSoftBody* b) override;

 private:
  btLazyDeformableBodySolver(const SolverOptions& options, bool solves_sleepers);

  // True if Bullet's solver needs a body that LazyCCD leaves out of the step.
  bool needs(const btSoftBody& sleeper) const;
  // Whether a body slept when the step began.
  bool slept(const btSoftBody& body) const;
  // Whether Bullet's islands have put it to sleep in this step.
  bool fell_asleep(const btSoftBody& body) const;
  // Clears the contact lists of bodies that were woken in this step. Otherwise Bullet would act on
  // contacts of an old step.
  void forget_old_contacts();
  void solve_momentum_equation(btScalar time_step);
  void move_nodes(btScalar time_step);
  void silence_bullet();
  void restore_bullet();
  void write_velocities();
  void write_positions();

  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<SoftBodyDbvt> dbvt_;
  std::unique_ptr<SideBySide> side_by_side_;
  std::unique_ptr<Normals> normals_;
  std::unique_ptr<BodyForces> body_forces_;
  std::unique_ptr<ExpectedContacts> expected_contacts_;
  std::unique_ptr<MomentumEquation> momentum_equation_;
  bool solves_sleepers_;
  btAlignedObjectArray<btSoftBody*> all_bodies_;  // m_softBodies lacks those of skipped_
  std::vector<const btSoftBody*> skipped_;        // sleepers that Bullet's solver skips; sorted
  std::vector<const btSoftBody*> slept_;          // when the step began; sorted
  std::vector<btSoftBody*> silenced_;             // their flag VF_DD is off
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
