// Where the next step is likely to lead, for a detector that begins with it before it is known.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/detector.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class MotionPrediction {
 public:
  // To be called where indices change: nothing is known of the next step then.
  void forget();
  // To be called when a step is done: the next one begins where it ends, goes on with its
  // velocities, and is led aside by Bullet as it was. `responded`: the motion's changes of velocity
  // are of this step.
  void remember(const Motion& motion, bool responded);
  // To be called after that; does nothing without it. Its positions are not written to before the
  // next detect().
  void announce(Detector& detector, double separation);
  // To be called with that step's motion as Bullet has it, after a detection that tested so many
  // candidates.
  void compare(const Motion& motion, std::int64_t candidates);

 private:
  // As little as a detection can tell from nothing, and as much as is still worth it: parts of the
  // separation.
  static constexpr double least = 1e-2, most = 0.5;
  // Fewer candidates are tested sooner than another thread would come.
  static constexpr std::int64_t few = 750;

  bool is_known_ = false, is_announced_ = false;
  std::int64_t candidates_ = 0;                   // of the last detection
  std::vector<btScalar> start_, straight_, end_;  // straight_: the end by velocities alone
  std::vector<btScalar> aside_;                   // of the last step: from there to where it led
  double off_ = 0;  // metres: how far off the last end was, or half as much as the one before
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
