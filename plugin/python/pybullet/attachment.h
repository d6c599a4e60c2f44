// LazyCCD's solver in a world that PyBullet made.
#pragma once

#include <lazyccd/bullet/deformable_body_solver.h>
#include <lazyccd/bullet/soft_body_solver.h>

#include <memory>
#include <string>
#include <vector>

class btDefaultSoftBodySolver;
class btDiscreteDynamicsWorld;

namespace lazyccd::pybullet {

/// Puts a solver of LazyCCD into a soft or deformable world, in place of Bullet's own. Leaves other
/// worlds alone, and those whose members are not what PyBullet 3.2.7 puts there; note() says why.
class Attachment {
 public:
  Attachment(btDiscreteDynamicsWorld& world, const bullet::SolverOptions& options);
  Attachment(const Attachment&) = delete;
  Attachment& operator=(const Attachment&) = delete;

  /// Gives the world its own solver back, and the bodies the trees that it reads. Without this call
  /// the destructor takes the world for gone.
  void detach();
  /// Puts a new solver in place of the one that is_attached().
  void restart(const bullet::SolverOptions& options);

  /// False if the world was left alone.
  bool is_attached() const { return deformable_ || soft_; }
  /// False if the world should have been one of LazyCCD's and its members are not as they should
  /// be.
  bool layout_is_known() const { return layout_is_known_; }
  const std::string& note() const { return note_; }  ///< what was done, one line

  btDiscreteDynamicsWorld& world() const { return *world_; }
  std::string status() const;
  std::vector<bullet::ExcludedBody> excluded_bodies() const;
  bullet::StepStats step_stats() const;   ///< of the last step; zero if the world was left alone
  bullet::StepStats total_stats() const;  ///< since the solver was put there
  Span<const bullet::StepContact> contacts() const;

 private:
  struct DeleteSolver {
    void operator()(btSoftBodySolver* solver) const;
  };

  void attach(const bullet::SolverOptions& options);
  void attach_deformable(const bullet::SolverOptions& options);
  void attach_soft(const bullet::SolverOptions& options);
  void refuse(const std::string& why);
  void build_trees();
  void give_solver_back();
  btAlignedObjectArray<btSoftBody*>& soft_bodies() const;
  void tell_bodies(btSoftBodySolver* solver);

  btDiscreteDynamicsWorld* world_;
  std::unique_ptr<bullet::btLazyDeformableBodySolver> deformable_;
  std::unique_ptr<bullet::btLazySoftBodySolver> soft_;
  // What was there before. The server deletes the deformable solver; the world would have deleted
  // the soft one.
  btDeformableBodySolver* stock_deformable_ = nullptr;
  int stock_passes_ = 0;
  std::unique_ptr<btSoftBodySolver, DeleteSolver> stock_soft_;
  bool layout_is_known_ = true;
  std::string note_;
};

}  // namespace lazyccd::pybullet
