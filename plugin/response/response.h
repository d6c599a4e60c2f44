// Changes the end of a step until nothing passes through anything.
#pragma once

#include <functional>
#include <vector>

#include "response/contact_constraints.h"
#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Response {
 public:
  // The contacts of the motion from `start` to `end`, without those that nothing may be done about.
  using Detect = std::function<std::vector<Contact>(const Positions& start, const Positions& end)>;

  Response(const SolverOptions& options, const PairSurfaces& surfaces)
      : options_(options), rows_(surfaces, options.position_correction) {}

  // `near` are the pairs that come near each other, of which those that give way are answered;
  // `detect_all` finds those that touch. In turn, each until the step is clean: impulses; rigid impact zones;
  // zones held at the start of the step, which is clean in the end because nothing moves any more.
  // Then motion.velocity_change says what velocities are to receive.
  void run(const SpeculativePairs& near, const Detect& detect_all, Motion& motion, StepStats& stats);

  // The rows of the pairs that acted in the last run(), sorted by contact.
  const std::vector<const ContactRow*>& rows() { return rows_.is_active(); }

  // To be called where the indices of bodies, vertices or faces change.
  void forget() { rows_.forget(); }

 private:
  void relax_near(const SpeculativePairs& near, Motion& motion);
  // Rigid impact zones, then holds.
  void end_contacts(std::vector<Contact> contacts, const Detect& detect, Motion& motion,
                    StepStats& stats);
  void finish(Motion& motion, StepStats& stats);

  SolverOptions options_;
  ContactConstraints rows_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
