#include "detection/motion_prediction.h"

#include <algorithm>
#include <cmath>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void MotionPrediction::forget() {
  is_known_ = false;
  correction_.clear();
}

void MotionPrediction::remember(const Motion& motion, bool responded) {
  start_ = motion.end;
  extrapolated_.resize(start_.size());
  const auto soft = static_cast<std::size_t>(motion.soft_count());
  for (std::size_t v = 0; v < soft; ++v) {
    Vector3d velocity = motion.velocity()[v];
    if (responded) velocity += motion.velocity_change[v];
    for (int k = 0; k < 3; ++k)
      extrapolated_[3 * v + k] =
          start_[3 * v + k] + static_cast<btScalar>(motion.dt() * velocity[k]);
  }
  for (std::size_t i = 3 * soft; i < start_.size(); ++i)
    extrapolated_[i] = motion.end[i] + (motion.end[i] - motion.start()[i]);
  correction_.resize(start_.size(), 0);
  end_.resize(start_.size());
  std::transform(extrapolated_.begin(), extrapolated_.end(), correction_.begin(), end_.begin(),
                 [](btScalar x, btScalar correction) { return x + correction; });
  is_known_ = true;
  was_tried_ = false;
}

void MotionPrediction::start_ahead(Detector& detector, double separation) {
  if (!is_known_ || was_tried_ || candidates_ < min_candidates) return;
  was_tried_ = true;
  constexpr double safety_factor = 3;  // changes only the cost
  const double tolerance = std::max(min_tolerance * separation, safety_factor * error_);
  if (!(tolerance < max_tolerance * separation)) return;
  const std::size_t count = start_.size() / 3;
  detector.detect_ahead({start_.data(), count}, {end_.data(), count}, tolerance);
}

void MotionPrediction::compare(const Motion& motion, std::int64_t candidates) {
  candidates_ = candidates;
  if (!is_known_ || end_.size() != motion.end.size()) return;
  double error_squared = 0;
  for (std::int32_t v = 0; v < static_cast<std::int32_t>(motion.size()); ++v)
    error_squared =
        std::max(error_squared, (motion.end_of(v) - Motion::read(end_, v)).squaredNorm());
  error_ = std::max(0.5 * error_, std::sqrt(error_squared));
  std::transform(motion.end.begin(), motion.end.end(), extrapolated_.begin(), correction_.begin(),
                 [](btScalar x, btScalar extrapolated) { return x - extrapolated; });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
