// The choice between the CPU and the GPU for Backend::automatic, from the times of the detections
// so far. Both find the same contacts, so it changes nothing but the cost. The size of the scene
// decides first, trials later (trial_choice.h).
#pragma once

#include <cstddef>

#include "lazyccd/detector.h"
#include "trial_choice.h"

namespace lazyccd {

class BackendChoice {
 public:
  /// Scenes with fewer faces never use the GPU: its launches alone cost more.
  static constexpr std::size_t min_gpu_faces = 1000;
  /// Scenes with fewer faces begin on the CPU.
  static constexpr std::size_t min_first_gpu_faces = 2000;
  /// Scenes with more faces stay on the GPU: the CPU needs longer for reading the positions alone,
  /// and building its hierarchy would be felt.
  static constexpr std::size_t max_cpu_faces = 200000;
  static constexpr double min_gain = 0.9, max_trial_share = TrialChoice::max_trial_share;

  /// Prepares for detections of a new topology. Times of a scene of about the same size are kept.
  void set_scene(std::size_t faces);
  /// Whether a scene of this size may use the GPU, now or later.
  static bool may_use_gpu(std::size_t faces) { return faces >= min_gpu_faces; }

  /// The backend of the next detection: cpu or cuda.
  Backend next() const { return trials_.next() == gpu ? Backend::cuda : Backend::cpu; }
  /// Records the wall time, milliseconds, of a detection by next(), with all that it prepared.
  void record(double ms);

 private:
  static constexpr int cpu = 0, gpu = 1;

  std::size_t faces_ = 0;
  TrialChoice trials_;
};

}  // namespace lazyccd
