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

#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/pair_handler.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class SoftBodyDbvt;
class Pipeline;

/// Bullet's deformable body solver with LazyCCD's contacts. See btLazySoftBodySolver for the
/// functions that both have.
class btLazyDeformableBodySolver : public btDeformableBodySolver, public PairHandler {
 public:
  explicit btLazyDeformableBodySolver(const SolverOptions& options = {});
  ~btLazyDeformableBodySolver() override;
  btLazyDeformableBodySolver(const btLazyDeformableBodySolver&) = delete;
  btLazyDeformableBodySolver& operator=(const btLazyDeformableBodySolver&) = delete;

  // The following six are as in btLazySoftBodySolver.
  Span<const StepContact> contacts() const;
  const StepStats& step_stats() const;
  const StepStats& total_stats() const;
  std::string status() const;
  void topology_changed();
  void teleported(const btCollisionObject& body);

  /// False after a step that ran without LazyCCD. The next step then keeps Bullet's own handling of
  /// soft pairs.
  bool is_active() const;

  void handle_pair(btSoftBody* a, btSoftBody* b) override;

  void predictMotion(btScalar solverdt) override;
  void setConstraints(const btContactSolverInfo& info) override;
  void solveDeformableConstraints(btScalar solverdt) override;
  void applyTransforms(btScalar timeStep) override;
  void processCollision(btSoftBody* body, const btCollisionObjectWrapper* other) override;
  void processCollision(btSoftBody* a, btSoftBody* b) override;

 private:
  // Clears the contact lists of bodies that were woken in this step. Otherwise Bullet would act on
  // contacts of an old step.
  void forget_old_contacts();
  void silence_bullet();
  void restore_bullet();
  void write_velocities();
  void write_positions();

  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<SoftBodyDbvt> dbvt_;
  std::vector<char> slept_;  // by body: slept when the step began
  std::vector<btSoftBody*> silenced_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
