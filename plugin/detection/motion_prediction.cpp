#include "detection/motion_prediction.h"

#include <algorithm>
#include <cmath>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void MotionPrediction::forget() {
  is_known_ = false;
  aside_.clear();
}

void MotionPrediction::remember(const Motion& motion, bool responded) {
  start_ = motion.end;
  straight_.resize(start_.size());
  const auto soft = static_cast<std::size_t>(motion.soft_count());
  for (std::size_t v = 0; v < soft; ++v) {
    Eigen::Vector3d velocity = motion.velocity[v];
    if (responded) velocity += motion.velocity_change[v];
    for (int k = 0; k < 3; ++k)
      straight_[3 * v + k] =
          start_[3 * v + k] + static_cast<btScalar>(motion.dt * velocity[k]);
  }
  for (std::size_t i = 3 * soft; i < start_.size(); ++i)
    straight_[i] = motion.end[i] + (motion.end[i] - motion.start[i]);
  aside_.resize(start_.size(), 0);
  end_.resize(start_.size());
  std::transform(straight_.begin(), straight_.end(), aside_.begin(), end_.begin(),
                 [](btScalar x, btScalar aside) { return x + aside; });
  is_known_ = true;
  is_announced_ = false;
}

void MotionPrediction::announce(Detector& detector, double separation) {
  if (!is_known_ || is_announced_ || candidates_ < few) return;
  is_announced_ = true;
  constexpr double room = 3;
  const double tolerance = std::max(least * separation, room * off_);
  if (!(tolerance < most * separation)) return;
  const std::size_t count = start_.size() / 3;
  detector.detect_ahead({start_.data(), count}, {end_.data(), count}, tolerance);
}

void MotionPrediction::compare(const Motion& motion, std::int64_t candidates) {
  candidates_ = candidates;
  if (!is_known_ || end_.size() != motion.end.size()) return;
  double off_squared = 0;
  for (std::int32_t v = 0; v < static_cast<std::int32_t>(motion.size()); ++v)
    off_squared = std::max(off_squared, (motion.end_of(v) - Motion::read(end_, v)).squaredNorm());
  off_ = std::max(0.5 * off_, std::sqrt(off_squared));
  std::transform(motion.end.begin(), motion.end.end(), straight_.begin(), aside_.begin(),
                 [](btScalar x, btScalar straight) { return x - straight; });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
