// Soft bodies in btSoftRigidDynamicsWorld and btSoftMultiBodyDynamicsWorld. The one changed line:
//
//   lazyccd::bullet::btLazySoftBodySolver solver;
//   btSoftRigidDynamicsWorld world(dispatcher, broadphase, constraints, configuration, &solver);
#pragma once

#include <BulletSoftBody/btDefaultSoftBodySolver.h>

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
class SoftConstraints;

// Bullet's own constraints of several bodies are solved at once, where that comes to the same. So
// what an application gives to btAlignedAllocSetCustom() or btSetCustomEnterProfileZoneFunc() is
// called by several threads, but not with SolverOptions::detector.threads = 1.
class btLazySoftBodySolver : public btDefaultSoftBodySolver, public PairHandler {
 public:
  explicit btLazySoftBodySolver(const SolverOptions& options = {});
  ~btLazySoftBodySolver() override;
  btLazySoftBodySolver(const btLazySoftBodySolver&) = delete;
  btLazySoftBodySolver& operator=(const btLazySoftBodySolver&) = delete;

  // Of the last step.
  Span<const StepContact> contacts() const;
  const StepStats& step_stats() const;
  // Over all steps.
  const StepStats& total_stats() const;
  // The backend in use, then a line for everything that was left out or failed, each once.
  std::string status() const;
  // To be called where an application changed node pointers of faces or links by its own hand;
  // Bullet's own ways of changing a body are noticed.
  void topology_changed();

  void handle_pair(btSoftBody* a, btSoftBody* b) override;

  void predictMotion(btScalar solverdt) override;
  void solveConstraints(btScalar solverdt) override;
  void updateSoftBodies() override;
  void processCollision(btSoftBody* body, const btCollisionObjectWrapper* other) override;
  void processCollision(btSoftBody* a, btSoftBody* b) override;

 private:
  void read_starts();
  void write_back();
  void list_contacts();

  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<SoftBodyDbvt> trees_;
  std::unique_ptr<SoftConstraints> constraints_;
  std::vector<std::vector<btVector3>> starts_;  // by body and node
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
