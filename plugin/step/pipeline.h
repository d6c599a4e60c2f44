// Runs one step of a scene of soft bodies: gather, detect, respond. Both solvers use it; each reads
// and writes Bullet's nodes in its own way. No failure within a step leaves it as an exception.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "detection/step_detector.h"
#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "response/response.h"
#include "scene/step_reader.h"
#include "step/checked_options.h"
#include "step/write_back.h"
#include "untangling/untangling.h"
#include "util/warning_log.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Everything of a solver that does not depend on the kind of world. One caller at a time.
class Pipeline {
 public:
  using Bodies = StepReader::Bodies;
  using Fill = StepReader::Fill;

  Pipeline(const SolverOptions& options, FrictionRule friction)
      : Pipeline(check(options), friction) {}

  /// Takes a pair from Bullet's dispatcher. Returns false if Bullet must process the pair itself.
  bool handle_pair(const btSoftBody* a, const btSoftBody* b) noexcept;
  /// True if LazyCCD alone handles the contacts of a soft body and a rigid one, so that Bullet must
  /// not process the pair.
  bool replaces_contacts(const btSoftBody* body, const btCollisionObject* rigid) const noexcept;
  /// Starts a step. Call it before Bullet moves anything, because Bullet then clears its marks of
  /// changed topology.
  void begin_step(const Bodies& bodies) noexcept;
  /// Starts the next step's detection on another thread. Call it when this step has been written.
  void detect_ahead() noexcept;

  /// Runs a step of `dt` seconds for the whole scene. Returns true on success. Then motion().end
  /// has no contacts left, except for StepStats::unresolved, and the caller must set the nodes to
  /// it. Returns false if the step must run without LazyCCD; status() says why.
  bool run(const Bodies& bodies, double dt, const Fill& fill) noexcept;

  // The following describe the last run().
  bool is_active() const { return is_active_; }
  const SoftScene& scene() const { return reader_.scene(); }
  const Motion& motion() const { return reader_.motion(); }
  /// True if the response moved this soft vertex or changed its velocity. False if it did not run.
  bool is_moved(std::int32_t vertex) const;
  /// True if the response ran.
  bool responded() const { return responded_; }
  const Threads& threads() const { return threads_; }
  /// Calls visit(record, first, last), which writes nodes, as in SoftScene::for_each_range(). Adds
  /// the time to StepStats::ms_write.
  void write(const SoftScene::Visit& visit);
  /// Wakes the soft bodies that the response moved.
  void wake_moved() const;
  /// Writes poses and velocities of the dynamic bodies that the response changed, and wakes them.
  void write_rigid_bodies() const {
    if (responded_) bullet::write_rigid_bodies(topology(), motion());
  }
  const std::vector<StepContact>& contacts() const { return contacts_; }
  /// Calls SolverOptions::on_contacts if there are contacts. Call it when nodes and velocities are
  /// those of the end of the step.
  void announce() noexcept;
  const StepStats& step() const { return step_; }

  const StepStats& total() const { return total_; }
  std::string status() const;
  /// Makes the next step read the whole scene again.
  void invalidate() { reader_.forget(); }
  WarningLog& warnings() { return warnings_; }

 private:
  Pipeline(const CheckedOptions& checked, FrictionRule friction);

  const StepTopology& topology() const { return reader_.topology(); }
  void update_surfaces();
  // Ends the step without LazyCCD and forgets the scene.
  void give_up(const std::string& why);
  // Reads the scene and its motion, and tells the detector about changes.
  void gather(const Bodies& bodies, double dt, const Fill& fill);
  // Detects and responds until the motion has no contacts left.
  void resolve_contacts();
  // Reports the step, and remembers it for the next one.
  void finish_step();
  // See StepReader::read_pushed_region(). True if the step must be detected again.
  bool read_pushed_region();
  void set_topology();
  Intersections find_intersections() const;
  void report_intersections();
  SpeculativePairs find_speculative_contacts();
  // Pushes apart bodies that intersect at the start of the step.
  void untangle();
  // Removes the contacts that would keep untangling bodies intersected.
  std::vector<Contact> remove_passable(std::vector<Contact> contacts) const;
  // Holds static and kinematic bodies that the response stopped at the start of the step.
  void hold_stopped_obstacles();
  double largest_thickness() const;
  void collect_contacts();

  SolverOptions options_;
  WarningLog warnings_;
  Threads threads_;
  StepReader reader_;
  PairSurfaces surfaces_;
  ContactFilter filter_;
  StepDetector detector_;
  Response response_;
  Untangling untangling_;
  std::vector<StepContact> contacts_;
  std::int64_t handled_pairs_ = 0;
  StepStats step_, total_;
  bool is_active_ = true;
  bool responded_ = false;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
