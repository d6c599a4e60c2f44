// One step of a scene of soft bodies: gather, detect, respond. Shared by the solvers of all worlds,
// which read and write Bullet's nodes in their own way. Nothing here throws.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "step/checked_options.h"
#include "util/warning_log.h"
#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "response/response.h"
#include "detection/step_detector.h"
#include "scene/step_reader.h"
#include "untangling/untangling.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Pipeline {
 public:
  using Bodies = StepReader::Bodies;
  using Fill = StepReader::Fill;

  Pipeline(const SolverOptions& options, PairSurfaces::SoftFriction friction) : Pipeline(check(options), friction) {}

  // A pair from Bullet's dispatcher. False where it is not LazyCCD's, so that Bullet is to process
  // it.
  bool handle_pair(const btSoftBody* a, const btSoftBody* b) noexcept;
  // A soft body and a rigid one whose contacts are LazyCCD's alone.
  bool handles(const btSoftBody* body, const btCollisionObject* rigid) const noexcept;
  // To be called before Bullet moves anything, while its marks of changed topology still stand.
  void begin_step(const Bodies& bodies) noexcept;
  // To be called where a step is written: another thread begins with the next one's detection.
  void detect_ahead() noexcept;

  // The whole scene, `seconds` long. True where it went its full way: then motion().end is clean
  // and is what the nodes should be set to. False where the step is Bullet's alone; status() says
  // why.
  bool run(const Bodies& bodies, double dt, const Fill& fill) noexcept;

  // Of the last run():
  bool is_active() const { return is_active_; }
  const SoftScene& scene() const { return reader_.scene(); }
  const Motion& motion() const { return reader_.motion(); }
  // The response moved this vertex, or changed its velocity. Only where it responded().
  bool is_moved(std::int32_t vertex) const;
  bool responded() const { return responded_; }
  const Threads& threads() const { return threads_; }
  // Sets nodes by visit(record, first, last), as SoftScene::for_each_range() has it.
  void write(const SoftScene::Visit& visit);
  // Wakes the soft bodies that the response moved.
  void wake_moved() const;
  // Gives rigid bodies what the response made of their motion.
  void write_rigid_bodies() const;
  const std::vector<StepContact>& contacts() const { return contacts_; }
  // Tells the application's listener, when nodes and velocities are those of the end of the step.
  void announce() noexcept;
  const StepStats& step() const { return step_; }

  const StepStats& total() const { return total_; }
  std::string status() const;
  void invalidate() { reader_.forget(); }
  WarningLog& warnings() { return warnings_; }

 private:
  Pipeline(const CheckedOptions& checked, PairSurfaces::SoftFriction friction);

  const StepTopology& topology() const { return reader_.topology(); }
  void update_surfaces();
  // Leaves the step to Bullet.
  void give_up(const std::string& why);
  void gather(const Bodies& bodies, double dt, const Fill& fill);
  bool read_where_pushed();
  void set_topology();
  Intersections find_intersections() const;
  void report_intersections();
  SpeculativePairs find_near();
  // Pushes apart what intersects where the step begins.
  void untangle();
  // Without the contacts that keep it so.
  std::vector<Contact> without_untangling(std::vector<Contact> contacts) const;
  void leave_stopped_obstacles();
  std::int32_t body_index(const StepTopology::BodyRecord& body) const;
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
