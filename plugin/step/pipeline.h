// Runs one step of a scene of soft bodies: gather, detect, respond. Both solvers use it; each reads
// and writes Bullet's nodes in its own way. No failure within a step leaves it as an exception.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "detection/step_detector.h"
#include "lazyccd/bullet/debug_draw.h"
#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "lazyccd/thread_choice.h"
#include "response/response.h"
#include "scene/step_reader.h"
#include "step/checked_options.h"
#include "step/joint_motors.h"
#include "step/scene_numbers.h"
#include "step/write_rigid_bodies.h"
#include "touching/touching_starts.h"
#include "untangling/embedded_parts.h"
#include "untangling/untangling.h"
#include "util/warning_log.h"

class btIDebugDraw;

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Everything of a solver that does not depend on the kind of world. One caller at a time.
class Pipeline {
 public:
  using Bodies = StepReader::Bodies;
  using Fill = StepReader::Fill;

  Pipeline(const SolverOptions& options, WorldKind world) : Pipeline(check(options), world) {}

  const SolverOptions& options() const { return options_; }

  /// Takes a pair from Bullet's dispatcher. Returns false if Bullet must process the pair itself.
  bool handle_pair(btSoftBody* a, btSoftBody* b) noexcept;
  /// True if LazyCCD alone handles the contacts of a soft body and a rigid one, so that Bullet must
  /// not process the pair.
  bool replaces_contacts(const btSoftBody* body, const btCollisionObject* rigid) const noexcept;
  /// The same for a pair from Bullet's dispatcher.
  bool handle_pair(const btSoftBody* body, const btCollisionObject* rigid) noexcept;
  /// Starts a step. Call it before Bullet moves anything, because Bullet then clears its marks of
  /// changed topology. `is_own_solver`: the solver's class is the application's. `forces`: of a
  /// deformable world.
  void begin_step(const Bodies& bodies, bool is_own_solver,
                  const ExcludedBodies::Forces* forces = nullptr) noexcept;
  /// Starts the next step's detection on another thread. Call it when this step has been written.
  void detect_ahead() noexcept;

  /// Runs a step of `dt` seconds for the whole scene. Returns true on success. Then motion().end
  /// has no contacts left, except for StepStats::unresolved, and the caller must set the nodes to
  /// it. Returns false if the step must run without LazyCCD; status() says why.
  /// `links`: as in Response::run(). `restart_links`: undoes what it did to nodes that are no
  /// vertices. Called whenever the solution of the step begins.
  bool run(const Bodies& bodies, double dt, const Fill& fill, const LinkSolver& links = {},
           const std::function<void()>& restart_links = {}) noexcept;

  // The following describe the last run().
  /// True if the last step ran with LazyCCD, and before the first step.
  bool ran_last_step() const { return ran_last_step_; }
  const SoftScene& scene() const { return reader_.scene(); }
  const Motion& motion() const { return reader_.motion(); }
  /// The sleeping bodies that the step left out, in the world's order. Some may have been deleted
  /// since.
  std::vector<const btSoftBody*> left_out() const { return reader_.sleepers().left_out(); }
  /// True if the response moved this soft vertex or changed its velocity. False if it did not run.
  bool is_moved(std::int32_t vertex) const;
  /// Soft bodies that the last step moved apart from something, sorted.
  std::vector<const btSoftBody*> moved_apart() const;
  /// True if the response ran.
  bool responded() const { return responded_; }
  const Threads& threads() const { return threads_; }
  /// Calls visit(record, first, last), which writes nodes, as in SoftScene::for_each_range(). Adds
  /// the time to StepStats::ms_write.
  void write(SoftScene::Visit visit);
  /// Wakes the soft bodies that the response moved.
  void wake_moved() const;
  /// Writes poses and velocities of the dynamic bodies that the response changed, and wakes them.
  void write_rigid_bodies() const {
    if (responded_) bullet::write_rigid_bodies(topology(), motion());
  }
  const std::vector<StepContact>& contacts() const { return contacts_; }
  std::vector<ExcludedBody> excluded_bodies() const { return scene().excluded().all(); }
  /// Draws the last step; nothing if it ran without LazyCCD.
  void debug_draw(btIDebugDraw& drawer, const DebugDrawOptions& options);
  /// Ends the step and calls SolverOptions::on_contacts if there are contacts. Call it when nodes
  /// and velocities are those of the end of the step.
  void end_step() noexcept;
  const StepStats& step_stats() const { return step_; }

  const StepStats& total_stats() const { return total_; }
  std::string status() const;
  /// See StepReader::teleported().
  void teleported(const btCollisionObject& object) { reader_.teleported(object); }
  /// See JointMotors::set_world().
  void use_motors_of(btMultiBodyDynamicsWorld* world) { motors_.set_world(world); }
  /// Makes the next step read the whole scene again.
  void invalidate() { reader_.invalidate(); }

 private:
  Pipeline(const CheckedOptions& checked, WorldKind world);

  const StepTopology& topology() const { return reader_.topology(); }
  // Says once that two soft bodies overlap whose flags keep them apart.
  void report_pair_without_flags(btSoftBody& a, btSoftBody& b) noexcept;
  void update_surfaces();
  // Ends the step without LazyCCD. The next step reads the soft bodies anew and has no warm start.
  void give_up(const std::string& why);
  // Tells the detector what changed in the scene.
  void take_changes(const StepReader::Changes& changes);
  // Detects and responds until the motion has no contacts left.
  void resolve_contacts(const LinkSolver& links, const std::function<void()>& restart_links);
  // Reports the step, and remembers it for the next one.
  void finish_step();
  // If the response moved soft bodies out of the region in which obstacles were read: reads the
  // obstacles of a larger region, and with them surfaces, topology and intersections. Returns true
  // if it did; the step must be detected again then.
  bool reread_obstacles_if_left();
  void set_topology(const std::vector<std::int32_t>& changed_bodies);
  // Finds the pinned nodes inside of bodies that nothing moves, around these bodies.
  void find_embedded(const std::vector<std::int32_t>& changed_bodies);
  // Takes the nodes that have no way out of an obstacle.
  void update_trapped(const Untangling::Found& found);
  // Edges that pass through faces at the start of the step. `of_bodies`: as for
  // bullet::find_intersections(), here and below.
  Intersections find_piercing(const std::vector<std::int32_t>* of_bodies) const;
  Untangling::Found find_intersections(const std::vector<std::int32_t>* of_bodies = nullptr) const;
  void report_intersections(const std::vector<std::int32_t>& changed_bodies);
  // Parts what touches one of these bodies.
  void part_touching(const std::vector<std::int32_t>& of_bodies);
  NearContacts find_near_contacts();
  // `links` of the bodies that are not pushed apart.
  LinkSolver without_pushed_bodies(const LinkSolver& links) const;
  // Pushes apart bodies that intersect at the start of the step.
  void untangle();
  // If the response stopped a static or kinematic body, keeps LazyCCD's copy of it at the start
  // pose.
  void hold_stopped_obstacles();
  double largest_thickness() const;
  void collect_contacts();

  SolverOptions options_;
  WarningLog warnings_;
  Threads threads_;
  ThreadChoice thread_choice_;
  StepReader reader_;
  PairSurfaces surfaces_;
  Untangling untangling_;
  ContactFilter filter_;
  StepDetector detector_;
  Response response_;
  JointMotors motors_;
  SceneNumbers scene_numbers_;
  EmbeddedParts embedded_;
  TouchingStarts touching_;
  std::vector<StepContact> contacts_;
  std::int64_t handled_pairs_ = 0;
  StepStats step_, total_;
  bool ran_last_step_ = true;
  bool responded_ = false;
  bool reported_pair_without_flags_ = false;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
