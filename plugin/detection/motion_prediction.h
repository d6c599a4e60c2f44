// Predicts the end of the next step, so that the detector can start on it before Bullet has solved
// that step.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/detector.h"
#include "motion/motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class MotionPrediction {
 public:
  /// Call when indices change: the next step cannot be predicted then.
  void forget();
  /// Predicts the next step from a finished one. The prediction starts at the end of this step and
  /// continues with its velocities. It then adds the deviation from this extrapolation that
  /// Bullet's solver caused in the last step. `responded`: motion.velocity_change belongs to this
  /// step.
  void remember(const Motion& motion, bool responded);
  /// Starts the detector on the predicted step. Call after remember(); without it the function does
  /// nothing. The positions that the detector reads stay unchanged until its next detect().
  void start_ahead(Detector& detector, double separation);
  /// Compares the prediction with the motion that Bullet actually produced. Call after the
  /// detection of that step; `candidates` is the number of candidates that it tested.
  void compare(const Motion& motion, std::int64_t candidates);

 private:
  /// Limits of the tolerance, as fractions of the separation. A tolerance below the minimum makes
  /// no difference to the detection; above the maximum the start ahead is not worth its cost.
  static constexpr double min_tolerance = 1e-2, max_tolerance = 0.5;  // change only the cost
  /// With fewer candidates, another thread costs more processor time than the step gets shorter.
  static constexpr std::int64_t min_candidates = 3000;

  bool is_known_ = false, was_tried_ = false;
  std::int64_t candidates_ = 0;  ///< number in the last detection
  /// extrapolated_: end of the step by velocities alone.
  std::vector<btScalar> start_, extrapolated_, end_;
  /// From the extrapolated end of the last step to its actual end.
  std::vector<btScalar> correction_;
  /// Metres: largest error of the last prediction, or half of the error before it if that is
  /// larger.
  double error_ = 0;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
