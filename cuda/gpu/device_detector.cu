#include "gpu/device_detector.h"

#include "gpu/device/device_info.h"
#include "gpu/step_stats.h"
#include "lazyccd/error.h"

namespace lazyccd::gpu {
namespace {

// Turns FrontUse::automatic into on. A traversal from a front avoids the descent of the tree level
// by level.
DetectorOptions with_front(DetectorOptions options) {
  if (options.algorithm.front == FrontUse::automatic) options.algorithm.front = FrontUse::on;
  return options;
}

}  // namespace

DeviceDetector::DeviceDetector(const DetectorOptions& options, ThreadPool& threads)
    : options_(with_front(options)),
      device_(chosen_device(options)),
      scope_(device_),
      device_name_(describe_device(device_)),
      pool_(threads),
      step_(options_),
      completion_(options_, step_, positions_, threads),
      front_policy_(options.algorithm.front_period, options.algorithm.front_ratio) {
  status_.reserve(1);
  scope_.leave();
}

// The host needs the edges itself for these options.
TopologyFinder* DeviceDetector::topology_finder() {
  const bool host_needs_edges =
      options_.separation > 0 || step_.needs_host_tree() || step_.needs_host_edges();
  return host_needs_edges ? nullptr : this;
}

FoundTopology DeviceDetector::find(const TopologyInput& input) {
  const DeviceScope scope(device_);
  settle();
  return topology_.build(input, step_.scene(), pool_, own_stream_);
}

void DeviceDetector::set_mesh(const Mesh& mesh) {
  mesh.complete(pool_);
  take_mesh(mesh, false);
}

void DeviceDetector::take_mesh(const Mesh& mesh, bool is_found) {
  const DeviceScope scope(device_);
  settle();
  mesh_ = &mesh;
  step_.set_mesh(mesh, is_found);
  completion_.set_mesh(mesh);
  positions_.forget();
  active_.forget();
  forget_result();
  is_built_ = false;
}

void DeviceDetector::forget_result() {
  result_ = {};
  gathered_ = {};
  has_step_ = has_result_ = false;
}

void DeviceDetector::check_key() const {
  if (!step_.key().is_two_words())
    throw NeedsCpu("millions of worlds and bodies need the CPU backend");
}

void DeviceDetector::settle() {
  if (has_work_) last_done_.wait();
  has_work_ = probe_.under_way = false;
}

void DeviceDetector::follow(cudaStream_t stream) {
  if (has_work_ && stream != stream_) last_done_.hold(stream);
  stream_ = stream;
}

StepInput DeviceDetector::input(bool from_front, ExactStage exact) const {
  return {positions_.start(),
          positions_.end(),
          positions_.is_double(),
          nullptr,
          from_front,
          exact,
          nullptr};
}

void DeviceDetector::count_build() {
  is_built_ = true;
  built_area_ = 0;
  ++builds_;
  front_policy_.forget();
}

void DeviceDetector::complete(const StepInput& input, bool has_run, Stats& stats) {
  try {
    completion_.run(input, has_run, given_, stream_, stats);
  } catch (const Error&) {
    is_built_ = false;  // perhaps from positions that are not finite
    throw;
  }
  step_.traversal().accept();
  stats.front_reused = input.from_front;
  fill_stats(step_, completion_.counters(), options_, stats);
  if (given_.start != nullptr) stats.ms_upload = uploaded_[1].since(uploaded_[0]);
  stats.peak_bytes = static_cast<std::int64_t>(step_.bytes() + positions_.bytes() +
                                               active_.bytes() + published_.bytes());
  front_policy_.saved(step_.traversal().counters().front_nodes, input.from_front);
  learn(completion_.counters());
}

void DeviceDetector::learn(const StepCounters& c) {
  // If the area has grown beyond this ratio, the next step rebuilds the hierarchy.
  if (built_area_ == 0) built_area_ = c.leaf_area;
  if (c.leaf_area > options_.algorithm.rebuild_ratio * built_area_) is_built_ = false;
  exact_policy_.record(c.undecided_in_double);
}

}  // namespace lazyccd::gpu
