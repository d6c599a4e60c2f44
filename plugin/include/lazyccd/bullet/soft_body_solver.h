// The solver for soft bodies in btSoftRigidDynamicsWorld and btSoftMultiBodyDynamicsWorld. An
// application changes one line:
//
//   lazyccd::bullet::btLazySoftBodySolver solver;
//   btSoftRigidDynamicsWorld world(dispatcher, broadphase, constraints, configuration, &solver);
#pragma once

#include <BulletSoftBody/btDefaultSoftBodySolver.h>

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

class Normals;
class SceneLinks;
class Pipeline;
class SideBySide;
class SoftBodyDbvt;
class SoftConstraints;
class Motion;

/// Bullet's default soft body solver with LazyCCD's contacts.
///
/// Does Bullet's own work on several bodies on several threads if the result is the same.
/// So functions given to btAlignedAllocSetCustom() and btSetCustomEnterProfileZoneFunc() are called
/// on several threads, except with SolverOptions::detector.threads = 1.
class LAZYCCD_BULLET_API btLazySoftBodySolver : public btDefaultSoftBodySolver, public PairHandler {
 public:
  explicit btLazySoftBodySolver(const SolverOptions& options = {});
  ~btLazySoftBodySolver() override;
  btLazySoftBodySolver(const btLazySoftBodySolver&) = delete;
  btLazySoftBodySolver& operator=(const btLazySoftBodySolver&) = delete;

  /// Contacts of the last step; valid until the next step.
  Span<const StepContact> contacts() const;
  const StepStats& step_stats() const;   ///< of the last step
  const StepStats& total_stats() const;  ///< summed over all steps
  /// The backend in use, then one line for each thing that was left out or failed.
  std::string status() const;
  /// The soft bodies that the last step left out because they are lost. status() names them too.
  std::vector<ExcludedBody> excluded_bodies() const;
  /// Draws the contacts, islands, impact zones and held nodes of the last step; see
  /// DebugDrawOptions. Call it between two steps. It does not ask for the drawer's mode. Steps that
  /// are not drawn cost no more for it.
  void debug_draw(btIDebugDraw& drawer, const DebugDrawOptions& options = {}) const;
  /// Makes the next step read the whole scene again. Call it after changing node pointers of faces
  /// or links, or the triangles of a mesh or terrain. Changes through Bullet's own functions are
  /// noticed without it.
  void topology_changed();
  /// Says that the application puts this body, rigid or soft, elsewhere before the end of the next
  /// step. Nothing is swept from its old place to the new one. Without this call a displacement is
  /// judged by SolverOptions::jump_speed.
  void teleported(const btCollisionObject& body);
  /// Lets the joint motors of this world's multibodies hold joints against contacts, as far as
  /// their largest impulses allow. Give it the world that the solver serves, which must live during
  /// its steps. Without this call, or with null, contacts move joints as if no motor held them.
  void use_motors_of(btMultiBodyDynamicsWorld* world);
  /// Builds Bullet's trees of nodes and faces, which are left out while nothing reads them. Call it
  /// between two steps, for each body that goes on with Bullet's own solver: in another world, or
  /// because this one gets that solver. Without it Bullet misses contacts. The destructor cannot
  /// do this, because the bodies may be gone by then.
  static void build_trees(btSoftBody& body);

  void handle_pair(btSoftBody* a, btSoftBody* b) override;

  void predictMotion(btScalar solverdt) override;
  void solveConstraints(btScalar solverdt) override;
  void updateSoftBodies() override;
  void processCollision(btSoftBody* body, const btCollisionObjectWrapper* other) override;
  void processCollision(btSoftBody* a, btSoftBody* b) override;

 private:
  void predict(btScalar time_step);
  void read_starts();
  bool solve_links(Span<const std::int32_t> bodies, double least, Motion& motion);
  // Moves nodes that are no vertices to where solve_links() has put them.
  void move_other_nodes(btScalar time_step);
  void write_back();

  std::unique_ptr<Pipeline> pipeline_;
  std::unique_ptr<SoftBodyDbvt> dbvt_;
  std::unique_ptr<SideBySide> side_by_side_;
  std::unique_ptr<Normals> normals_;
  std::unique_ptr<SceneLinks> scene_links_;
  std::unique_ptr<SoftConstraints> constraints_;
  std::vector<char> slept_;  // by body: slept when the step began
  // At the start of the step, by body and node; empty for bodies that sleep.
  std::vector<std::vector<btVector3>> starts_;
  // Positions after solve_links(), by body and node; empty for bodies that it did not touch.
  std::vector<std::vector<btVector3>> link_positions_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
