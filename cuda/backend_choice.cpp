#include "backend_choice.h"

namespace lazyccd {
namespace {

// Detections before the first trial.
constexpr int first_interval = 100;
// A detection of the GPU costs at least this much, milliseconds.
constexpr double min_gpu_ms = 0.05;
// First estimates of what a trial costs, milliseconds: a part for each face (a hierarchy is built),
// and a constant part (kernels are loaded).
constexpr double cpu_trial_ms_per_face = 1e-3, gpu_trial_ms_per_face = 1e-4, gpu_trial_ms = 5;

}  // namespace

void BackendChoice::set_scene(std::size_t faces) {
  const double size = static_cast<double>(faces);
  const bool is_similar = are_similar(size, static_cast<double>(faces_)) &&
                          may_use_gpu(faces) == may_use_gpu(faces_) &&
                          (faces > max_cpu_faces) == (faces_ > max_cpu_faces);
  if (is_similar) return trials_.restart();
  faces_ = faces;
  trials_ = faces >= min_first_gpu_faces
                ? TrialChoice(gpu, cpu_trial_ms_per_face * size, first_interval)
                : TrialChoice(cpu, gpu_trial_ms + gpu_trial_ms_per_face * size, first_interval);
}

void BackendChoice::record(double ms) {
  const bool may_try = may_use_gpu(faces_) && faces_ <= max_cpu_faces &&
                       (trials_.current() == gpu || trials_.median() * min_gain >= min_gpu_ms);
  trials_.record(ms, {may_try, min_gain});
}

}  // namespace lazyccd
