#include "backend_choice.h"

#include <algorithm>

namespace lazyccd {
namespace {

// The first detections of a backend build hierarchies, graphs and lists. They tell nothing of later
// ones.
constexpr int warm_up_detections = 3;
constexpr int trial_detections = warm_up_detections + 5;
// A trial ends early if a detection after the warm-up needs this many times the other's time.
constexpr double hopeless = 2;
// Detections between two trials. The number doubles with each trial that changes nothing. If the
// cost of the scene has changed by the factor, the next trial comes sooner.
constexpr int min_interval = 100, max_interval = 1000, interval_after_change = 20;
constexpr double changed_cost = 1.5;
// A detection of the GPU costs at least this much, milliseconds.
constexpr double min_gpu_ms = 0.05;
// First estimates of what a trial costs, milliseconds: a part for each face (a hierarchy is built),
// and a constant part (kernels are loaded).
constexpr double cpu_trial_ms_per_face = 1e-3, gpu_trial_ms_per_face = 1e-4, gpu_trial_ms = 5;

bool are_similar(double a, double b) { return a <= changed_cost * b && b <= changed_cost * a; }

}  // namespace

double BackendChoice::Times::median() const {
  std::array<double, size> sorted = ms_;
  const auto middle = sorted.begin() + size / 2;
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

void BackendChoice::set_scene(std::size_t faces) {
  left_in_trial_ = 0;
  warm_up_ = warm_up_detections;
  times_.clear();
  const bool is_similar = are_similar(static_cast<double>(faces), static_cast<double>(faces_)) &&
                          may_use_gpu(faces) == may_use_gpu(faces_) &&
                          (faces > max_cpu_faces) == (faces_ > max_cpu_faces);
  if (is_similar) return;
  *this = {};
  faces_ = faces;
  warm_up_ = warm_up_detections;
  interval_ = min_interval;
  if (faces >= min_first_gpu_faces) current_ = Backend::cuda;
  const double size = static_cast<double>(faces);
  trial_cost_ms_ = current_ == Backend::cuda ? cpu_trial_ms_per_face * size
                                             : gpu_trial_ms + gpu_trial_ms_per_face * size;
}

void BackendChoice::record(double ms) {
  total_ms_ += ms;
  if (left_in_trial_ > 0) return record_trial(ms);
  ++since_trial_;
  if (warm_up_ > 0) {
    --warm_up_;
    return;
  }
  times_.add(ms);
  if (!starts_trial()) return;
  left_in_trial_ = trial_detections;
  trial_times_.clear();
  trial_cost_ms_ = 0;
  if (!are_similar(times_.median(), last_median_ms_)) interval_ = min_interval;
  last_median_ms_ = times_.median();
}

bool BackendChoice::starts_trial() const {
  if (!may_use_gpu(faces_) || faces_ > max_cpu_faces || !times_.is_full()) return false;
  const double median = times_.median();
  const bool has_changed = last_median_ms_ > 0 && !are_similar(median, last_median_ms_);
  if (since_trial_ < (has_changed ? interval_after_change : interval_)) return false;
  if (current_ == Backend::cpu && median * min_gain < min_gpu_ms) return false;
  return spent_ms_ + trial_cost_ms_ <= max_trial_share * total_ms_;
}

void BackendChoice::record_trial(double ms) {
  --left_in_trial_;
  const double excess = std::max(0.0, ms - last_median_ms_);
  const bool is_first = left_in_trial_ == trial_detections - 1;
  // The first detection may have started the device. In the next trial it will cost what the second
  // costs now.
  const bool is_second = left_in_trial_ == trial_detections - 2;
  spent_ms_ += excess;
  trial_cost_ms_ += is_first ? 0 : is_second ? 2 * excess : excess;
  if (left_in_trial_ >= trial_detections - warm_up_detections) {
    if (!is_first && trial_cost_ms_ > max_trial_share * total_ms_) end_trial(false);
    return;
  }
  trial_times_.add(ms);
  if (left_in_trial_ == 0)
    end_trial(trial_times_.median() < min_gain * last_median_ms_);
  else if (ms > hopeless * last_median_ms_)
    end_trial(false);
}

void BackendChoice::end_trial(bool takes_over) {
  left_in_trial_ = 0;
  since_trial_ = 0;
  if (!takes_over) {
    interval_ = std::min(2 * interval_, max_interval);
    return;
  }
  current_ = other(current_);
  times_ = trial_times_;
  last_median_ms_ = times_.median();
  interval_ = min_interval;
}

}  // namespace lazyccd
