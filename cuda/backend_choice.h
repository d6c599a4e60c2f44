// The choice between the CPU and the GPU for Backend::automatic, from the times of the detections
// so far. Both find the same contacts, so it changes nothing but the cost.
//
// The size of the scene decides first. Later, now and then, the other backend gets a trial of a few
// detections. It takes over if it needs less than `min_gain` times the time. What trials cost over
// the detections that they replace is spent from a budget: `max_trial_share` of the whole time. The
// next trial waits until the budget allows for it.
#pragma once

#include <array>
#include <cstddef>

#include "lazyccd/detector.h"

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
  static constexpr double min_gain = 0.9, max_trial_share = 0.02;

  /// Prepares for detections of a new topology. Times of a scene of about the same size are kept.
  void set_scene(std::size_t faces);
  /// Whether a scene of this size may use the GPU, now or later.
  static bool may_use_gpu(std::size_t faces) { return faces >= min_gpu_faces; }

  /// The backend of the next detection: cpu or cuda.
  Backend next() const { return left_in_trial_ > 0 ? other(current_) : current_; }
  /// Records the wall time, milliseconds, of a detection by next(), with all that it prepared.
  void record(double ms);

 private:
  // Times of the last detections. A median ignores the pauses that other programs cause.
  class Times {
   public:
    void clear() { count_ = 0; }
    void add(double ms) { ms_[count_++ % size] = ms; }
    bool is_full() const { return count_ >= size; }
    double median() const;

   private:
    static constexpr std::size_t size = 5;
    std::array<double, size> ms_{};
    std::size_t count_ = 0;
  };

  static Backend other(Backend backend) {
    return backend == Backend::cpu ? Backend::cuda : Backend::cpu;
  }
  void record_trial(double ms);
  void end_trial(bool takes_over);
  bool starts_trial() const;

  std::size_t faces_ = 0;
  Backend current_ = Backend::cpu;
  Times times_, trial_times_;  // of the current backend, and of the other one in its last trial
  int warm_up_ = 0;            // detections that are still to be ignored
  int left_in_trial_ = 0;      // detections until the trial ends; 0: there is none

  double total_ms_ = 0;                 // of all detections of this scene
  double spent_ms_ = 0;                 // by all trials, over what they replaced
  double trial_cost_ms_ = 0;            // what the next trial is expected to spend
  double last_median_ms_ = 0;           // of the current backend at the last trial
  int since_trial_ = 0, interval_ = 0;  // detections since the last trial, and before the next one
};

}  // namespace lazyccd
