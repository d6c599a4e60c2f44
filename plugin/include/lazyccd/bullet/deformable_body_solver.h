// Deformable bodies in btDeformableMultiBodyDynamicsWorld. The one changed line:
//
//   lazyccd::bullet::btLazyDeformableBodySolver solver;
//   btDeformableMultiBodyDynamicsWorld world(dispatcher, broadphase, constraints, config, &solver);
//
// That world also runs Bullet's own continuous detection, whose result nothing uses;
// btLazyDeformableMultiBodyDynamicsWorld of deformable_world.h does not.
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

class btLazyDeformableBodySolver : public btDeformableBodySolver, public PairHandler {
 public:
  explicit btLazyDeformableBodySolver(const SolverOptions& options = {});
  ~btLazyDeformableBodySolver() override;
  btLazyDeformableBodySolver(const btLazyDeformableBodySolver&) = delete;
  btLazyDeformableBodySolver& operator=(const btLazyDeformableBodySolver&) = delete;

  // As in btLazySoftBodySolver.
  Span<const StepContact> contacts() const;
  const StepStats& step_stats() const;
  const StepStats& total_stats() const;
  std::string status() const;
  void topology_changed();

  // False after a step that had to go on without LazyCCD: Bullet's own handling of soft pairs is
  // the better one then.
  bool is_active() const;

  void handle_pair(btSoftBody* a, btSoftBody* b) override;

  void predictMotion(btScalar solverdt) override;
  void solveDeformableConstraints(btScalar solverdt) override;
  void applyTransforms(btScalar timeStep) override;
  void processCollision(btSoftBody* body, const btCollisionObjectWrapper* other) override;
  void processCollision(btSoftBody* a, btSoftBody* b) override;

 private:
  void silence_bullet();
  void restore_bullet();
  void write_velocities();
  void write_positions();
  void list_contacts();

  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<SoftBodyDbvt> trees_;
  std::vector<btSoftBody*> silenced_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
