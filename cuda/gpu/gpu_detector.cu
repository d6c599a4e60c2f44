// The CUDA backend: runs steps on a stream, makes room where one did not fit, and merges the
// contacts that only the host can decide.
#include "gpu/gpu_detector.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "core/bvh/front_policy.h"
#include "core/exact/stage_policy.h"
#include "cpu/scene/positions.h"
#include "cpu/threads/thread_pool.h"
#include "gpu/device/device_info.h"
#include "gpu/device/device_scope.h"
#include "gpu/narrow/undecided.h"
#include "gpu/scene/active_bodies.h"
#include "gpu/scene/packed_positions.h"
#include "gpu/step.h"
#include "lazyccd/error.h"

namespace lazyccd {
namespace {

using gpu::ExactStage;

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

// Turns FrontUse::automatic into on. A traversal from a front avoids the descent of the tree level
// by level.
DetectorOptions with_front(DetectorOptions options) {
  if (options.algorithm.front == FrontUse::automatic) options.algorithm.front = FrontUse::on;
  return options;
}

// Adds the counters of one part of a step's pairs to those of the parts before.
void add_part(gpu::StepCounters& sum, const gpu::StepCounters& c) {
  for (int kind = 0; kind < 2; ++kind) {
    sum.candidates[kind] += c.candidates[kind];
    sum.filtered[kind] += c.filtered[kind];
    sum.hits[kind] += c.hits[kind];
    sum.undecided_in_single[kind] += c.undecided_in_single[kind];
  }
  sum.double_precision_tests += c.double_precision_tests;
  sum.undecided_in_double += c.undecided_in_double;
  sum.contacts += c.contacts;
  sum.contacts_vf += c.contacts_vf;
  sum.hash += c.hash;
}

class GpuDetector : public DeviceBackend {
 public:
  GpuDetector(const DetectorOptions& options, ThreadPool& threads)
      : options_(with_front(options)),
        device_(gpu::chosen_device(options)),
        scope_(device_),
        device_name_(gpu::describe_device(device_)),
        pool_(threads),
        step_(options_),
        front_policy_(options.algorithm.front_period, options.algorithm.front_ratio) {
    status_.reserve(1);
    scope_.leave();
  }
  ~GpuDetector() override { scope_.enter(); }

  void set_mesh(const Mesh& mesh) override {
    const gpu::DeviceScope scope(device_);
    settle();
    mesh_ = &mesh;
    step_.set_mesh(mesh);
    positions_.forget();
    active_.forget();
    result_ = {};
    is_built_ = has_step_ = false;
  }

  Span<const Contact> detect(const Positions& start, const Positions& end, Stats& stats) override;
  DeviceContacts detect_async(const DevicePositions& start, const DevicePositions& end,
                              CudaStream stream, const std::uint8_t* world_mask) override;
  DeviceContacts synchronize(Stats& stats) override;
  Span<const Contact> download() override;

 private:
  // Whether the counters of a step are on their way to the host, and of which step.
  struct Probe {
    gpu::Event done;
    bool under_way = false;
    bool front_reused = false;
    std::int64_t build = 0;  // number of the build that the step used
  };

  gpu::StepInput input(bool from_front, ExactStage exact) const;
  void follow(cudaStream_t stream);
  void settle();
  void learn(const gpu::StepCounters& counters);
  void read_probe();
  void prepare_build(bool needed);
  void check_positions(const gpu::StepCounters& counters);
  bool finish(gpu::StepInput& input, bool has_run, Stats& stats);
  void run_in_parts(const gpu::StepInput& input, Stats& stats);
  Span<const Contact> gather_contacts(Stats& stats);
  std::pair<Positions, Positions> host_positions();
  void fill(Stats& stats);
  void publish(Span<const Contact> contacts, std::uint64_t hash);

  DetectorOptions options_;
  int device_;
  gpu::DeviceScope scope_;  // while the members below begin and end
  std::string device_name_;
  gpu::Stream own_stream_;
  gpu::Event uploaded_[2];
  ThreadPool& pool_;

  const Mesh* mesh_ = nullptr;
  bool is_built_ = false;
  std::int64_t builds_ = 0;
  float built_area_ = 0;  // StepCounters::leaf_area of the first step after the build; 0: none yet
  gpu::PackedPositions positions_;
  gpu::ActiveBodies active_;
  gpu::Step step_;
  FrontPolicy front_policy_;
  exact::StagePolicy exact_policy_;
  gpu::StepCounters counters_{};  // of the last step, all parts

  // Contacts of a step that ran in parts, with room for those of its wide queries.
  bool in_parts_ = false;
  std::vector<Contact> part_contacts_;
  std::vector<gpu::HardQuery> part_queries_;

  // The last detect_async().
  cudaStream_t stream_ = nullptr;  // of the last step
  gpu::Event last_done_;
  bool has_step_ = false;  // it was enqueued, and synchronize() has not completed it
  bool has_work_ = false;  // work of another stream than own_stream_ may be under way
  bool had_front_ = false;
  gpu::StepInput last_input_{};
  Probe probe_;
  DeviceBuffer<DeviceStatus> status_;
  DeviceBuffer<Contact> published_;
  DeviceContacts result_;
  Span<const Contact> gathered_;  // the result on the host; null if it is only on the device
  std::vector<double> host_start_, host_end_;
  const Positions* given_[2] = {nullptr, nullptr};  // the host's positions of detect()
};

gpu::StepInput GpuDetector::input(bool from_front, ExactStage exact) const {
  return {positions_.start(),
          positions_.end(),
          positions_.is_double(),
          nullptr,
          from_front,
          exact,
          nullptr};
}

// Lets work on `stream` come behind the last step.
void GpuDetector::follow(cudaStream_t stream) {
  if (has_work_ && stream != stream_) last_done_.hold(stream);
  stream_ = stream;
}

// Waits until no step is under way.
void GpuDetector::settle() {
  if (has_work_) last_done_.wait();
  has_work_ = probe_.under_way = false;
}

// Takes in what a step says about the next ones.
void GpuDetector::learn(const gpu::StepCounters& c) {
  // If the area has grown beyond this ratio, the next step rebuilds the hierarchy.
  if (built_area_ == 0) built_area_ = c.leaf_area;
  if (c.leaf_area > options_.algorithm.rebuild_ratio * built_area_) is_built_ = false;
  exact_policy_.record(c.undecided_in_double);
}

void GpuDetector::prepare_build(bool needed) {
  if (!needed) return;
  is_built_ = true;
  built_area_ = 0;
  ++builds_;
  front_policy_.forget();
}

// Throws if the step met positions that it cannot take.
void GpuDetector::check_positions(const gpu::StepCounters& c) {
  if (c.bad_positions == 0) return;
  is_built_ = false;  // perhaps from these positions
  if (c.bad_positions & 1) {
    const auto [start, end] = host_positions();
    check_finite(*mesh_, start, end);
  }
  throw Error(ErrorCode::device, "positions beyond 2^100 need the CPU backend");
}

// Completes a step: waits for it, and runs again what did not fit, from the stage on where it did
// not. Returns whether memory was too short for that, so that the pairs must be taken in parts.
bool GpuDetector::finish(gpu::StepInput& input, bool has_run, Stats& stats) {
  enum { nothing, pairs, all } next = has_run ? nothing : all;
  for (;;) {
    if (next != nothing) step_.reserve_lists(stream_);
    if (next == all) step_.run(input, stream_);
    if (next == pairs) step_.run_pairs(input, {0, 0xffffffffu}, stream_);
    step_.download(stream_);
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream_));
    const gpu::StepCounters& c = step_.buffers().counters();
    check_positions(c);
    const int grown_traversal = step_.grow_traversal(stream_);
    const int grown_lists = step_.grow_lists();
    const bool wraps = (c.candidates[0] | c.candidates[1]) >> 32 != 0;  // as filtered[] may have
    stats.overflows += grown_traversal + grown_lists;
    if (grown_traversal != 0) {
      next = all;
    } else if (wraps || (grown_lists != 0 && step_.lists_are_limited())) {
      return true;
    } else if (grown_lists != 0) {
      next = pairs;
    } else if (c.undecided_in_double != 0 && input.exact == ExactStage::left_out &&
               options_.separation == 0) {
      input.exact = ExactStage::expected;
      step_.run_exact(input, stream_);
      next = nothing;
    } else {
      counters_ = c;
      return false;
    }
  }
}

// Takes the pairs of the traversal in parts that the lists have room for.
void GpuDetector::run_in_parts(const gpu::StepInput& input, Stats& stats) {
  gpu::StepBuffers& buffers = step_.buffers();
  const std::uint32_t pairs = step_.traversal().counters().leaf_pairs;
  gpu::StepCounters sum{};
  part_contacts_.clear();
  part_queries_.clear();
  std::uint32_t size = std::max(pairs / 2, 1u);
  stats.parts = 0;
  for (std::uint32_t first = 0; first < pairs || stats.parts == 0;) {
    const std::uint32_t last = first + std::min(size, pairs - first);
    step_.reserve_lists(stream_);
    step_.run_pairs(input, {first, last}, stream_);
    step_.download(stream_);
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream_));
    const gpu::StepCounters& c = buffers.counters();
    if (buffers.grow(false) != 0 || (c.candidates[0] | c.candidates[1]) >> 32 != 0) {
      if (last - first <= 1)
        throw OutOfDeviceMemory("the candidates of two groups do not fit into the device's memory");
      size = std::max((last - first) / 4, 1u);
      continue;
    }
    const Contact* const contacts = buffers.finish_contacts();
    part_contacts_.insert(part_contacts_.end(), contacts, contacts + c.contacts);
    if (c.too_wide != 0) {
      const gpu::HardQuery* const queries = buffers.download_too_wide();
      part_queries_.insert(part_queries_.end(), queries, queries + c.too_wide);
    }
    add_part(sum, c);
    sum.leaf_area = c.leaf_area;
    ++stats.parts;
    first = last;
  }
  counters_ = sum;
  std::sort(part_contacts_.begin(), part_contacts_.end(), mesh_->contact_order());
}

// Returns the positions of the last step on the host. Those that lie on the device are copied.
std::pair<Positions, Positions> GpuDetector::host_positions() {
  if (given_[0] != nullptr) return {*given_[0], *given_[1]};
  const std::size_t count = mesh_->vertex_count(), values = 3 * count;
  const std::size_t size = values * (positions_.is_double() ? sizeof(double) : sizeof(float));
  host_start_.resize(values);
  host_end_.resize(values);
  LAZYCCD_CUDA_CHECK(
      cudaMemcpy(host_start_.data(), positions_.start(), size, cudaMemcpyDeviceToHost));
  LAZYCCD_CUDA_CHECK(cudaMemcpy(host_end_.data(), positions_.end(), size, cudaMemcpyDeviceToHost));
  if (positions_.is_double()) return {{host_start_.data(), count}, {host_end_.data(), count}};
  return {{reinterpret_cast<const float*>(host_start_.data()), count},
          {reinterpret_cast<const float*>(host_end_.data()), count}};
}

// Returns the contacts of a completed step on the host, with those that only the host can decide.
Span<const Contact> GpuDetector::gather_contacts(Stats& stats) {
  gpu::StepBuffers& buffers = step_.buffers();
  const std::size_t wide = in_parts_ ? part_queries_.size() : counters_.too_wide;
  std::size_t count = counters_.contacts;
  if (in_parts_) part_contacts_.resize(count + wide);
  Contact* const contacts = in_parts_ ? part_contacts_.data() : buffers.finish_contacts();
  if (wide != 0) {
    const gpu::HardQuery* const queries =
        in_parts_ ? part_queries_.data() : buffers.download_too_wide();
    const auto [start, end] = host_positions();
    count = gpu::merge_undecided(*mesh_, start, end, queries, wide, pool_, contacts, count, stats);
  }
  return {contacts, count};
}

Span<const Contact> GpuDetector::detect(const Positions& start, const Positions& end,
                                        Stats& stats) {
  const auto begin = std::chrono::steady_clock::now();
  const gpu::DeviceScope scope(device_);
  check_counts(*mesh_, start, end);
  stats.backend = "cuda";
  stats.device = device_name_;
  settle();
  has_step_ = false;
  if (mesh_->edges().empty()) return {};

  stream_ = own_stream_;
  given_[0] = &start;
  given_[1] = &end;
  uploaded_[0].record(stream_);
  positions_.upload(start, end, pool_, stream_);
  uploaded_[1].record(stream_);
  stats.rebuilt = !is_built_ || options_.algorithm.rebuild_every_step;
  if (stats.rebuilt && step_.needs_host_tree()) step_.build_on_host(start, end, pool_, stream_);
  if (stats.rebuilt && !step_.needs_host_tree())
    step_.build(input(false, ExactStage::left_out), stream_);
  prepare_build(stats.rebuilt);
  if (!step_.key().is_two_words())
    throw Error(ErrorCode::device, "millions of worlds and bodies need the CPU backend");
  stats.front_reused = step_.traversal().has_front() && front_policy_.reuse();
  const bool has_exact = options_.separation == 0;
  gpu::StepInput step =
      input(stats.front_reused, has_exact && exact_policy_.launches_ahead() ? ExactStage::expected
                                                                            : ExactStage::left_out);
  in_parts_ = finish(step, false, stats);
  if (has_exact) step.exact = ExactStage::expected;
  if (in_parts_) run_in_parts(step, stats);
  step_.traversal().accept();
  fill(stats);
  front_policy_.saved(step_.traversal().counters().front_nodes, stats.front_reused);
  learn(counters_);
  const Span<const Contact> contacts = gather_contacts(stats);
  stats.ms_total = milliseconds_since(begin);
  return contacts;
}

// Takes in the counters of an earlier step, if they have come. Makes the room that it lacked.
void GpuDetector::read_probe() {
  if (!probe_.under_way || !probe_.done.has_passed()) return;
  probe_.under_way = false;
  const TraversalCounters& t = step_.traversal().counters();
  front_policy_.saved(t.front_nodes, probe_.front_reused);
  if (probe_.build == builds_) learn(step_.buffers().counters());
  if (step_.grow_traversal(stream_) != 0) step_.traversal().forget_front();
  step_.grow_lists();
}

DeviceContacts GpuDetector::detect_async(const DevicePositions& start, const DevicePositions& end,
                                         CudaStream stream, const std::uint8_t* world_mask) {
  const gpu::DeviceScope scope(device_);
  const auto refuse = [](ErrorCode code, const char* what) { throw Error(code, what); };
  if (start.count() != mesh_->vertex_count() || end.count() != mesh_->vertex_count())
    refuse(ErrorCode::size_mismatch, "detect_async() needs a position for each vertex");
  if (start.is_double() != end.is_double())
    refuse(ErrorCode::invalid_argument, "start and end have different precisions");
  if (options_.separation > 0)
    refuse(ErrorCode::invalid_argument, "with a separation only detect() works");
  if (step_.needs_host_tree())
    refuse(ErrorCode::invalid_argument, "with normal cones only detect() works");
  follow(stream);
  if (mesh_->edges().empty()) {
    publish({}, 0);
    return result_;
  }
  read_probe();
  given_[0] = given_[1] = nullptr;
  positions_.gather(start, end, stream);
  const bool builds = !is_built_ || options_.algorithm.rebuild_every_step;
  if (builds) step_.build(input(false, ExactStage::left_out), stream);
  prepare_build(builds);
  if (!step_.key().is_two_words())
    refuse(ErrorCode::device, "millions of worlds and bodies need the CPU backend");
  step_.reserve_lists(stream);

  had_front_ = step_.traversal().has_front();
  last_input_ =
      input(had_front_ && front_policy_.reuse(),
            exact_policy_.launches_ahead() ? ExactStage::expected : ExactStage::unexpected);
  last_input_.status = status_.data();
  if (world_mask != nullptr) last_input_.active = active_.update(*mesh_, world_mask, stream);
  step_.run(last_input_, stream);
  if (!probe_.under_way) {
    step_.download_counters(stream);
    probe_.done.record(stream);
    probe_.under_way = true;
    probe_.front_reused = last_input_.from_front;
    probe_.build = builds_;
  }
  step_.traversal().accept();
  last_done_.record(stream);
  has_step_ = has_work_ = true;
  result_ = {step_.buffers().sorted(), status_.data(), step_.buffers().contact_capacity(), device_};
  return result_;
}

DeviceContacts GpuDetector::synchronize(Stats& stats) {
  const gpu::DeviceScope scope(device_);
  stats.backend = "cuda";
  stats.device = device_name_;
  settle();
  if (!has_step_) return result_;
  has_step_ = false;
  gathered_ = {};
  step_.traversal().take_back(had_front_);
  gpu::StepInput step = last_input_;
  in_parts_ = finish(step, true, stats);
  if (in_parts_) run_in_parts(step, stats);
  step_.traversal().accept();
  stats.front_reused = step.from_front;
  fill(stats);
  front_policy_.saved(step_.traversal().counters().front_nodes, step.from_front);
  learn(counters_);
  if (in_parts_ || counters_.too_wide != 0) {
    gathered_ = gather_contacts(stats);
    publish(gathered_, stats.hash);
  } else {
    result_ = {step_.buffers().sorted(), status_.data(), step_.buffers().contact_capacity(),
               device_};
  }
  return result_;
}

// Copies contacts of the host to the device, as the result.
void GpuDetector::publish(Span<const Contact> contacts, std::uint64_t hash) {
  published_.reserve(std::max<std::size_t>(contacts.size(), 1));
  const DeviceStatus status{hash, static_cast<std::uint32_t>(contacts.size()), 0};
  // Ordinary host memory: each copy has been read when the call returns.
  LAZYCCD_CUDA_CHECK(
      cudaMemcpyAsync(status_.data(), &status, sizeof(status), cudaMemcpyHostToDevice, stream_));
  if (!contacts.empty())
    LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(published_.data(), contacts.data(),
                                       contacts.size() * sizeof(Contact), cudaMemcpyHostToDevice,
                                       stream_));
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream_));
  result_ = {published_.data(), status_.data(), published_.size(), device_};
}

Span<const Contact> GpuDetector::download() {
  const gpu::DeviceScope scope(device_);
  if (mesh_->edges().empty()) return {};
  if (gathered_.data() != nullptr) return gathered_;
  return {step_.buffers().finish_contacts(), counters_.contacts};
}

void GpuDetector::fill(Stats& stats) {
  const TraversalCounters& t = step_.traversal().counters();
  stats.groups = step_.group_count();
  stats.tree_tests = static_cast<std::int64_t>(t.tree_tests);
  stats.front_nodes = static_cast<std::int64_t>(t.front_nodes);
  stats.idle_share = step_.traversal().idle_share();
  stats.steals = static_cast<std::int64_t>(t.steals);
  stats.balancings = static_cast<std::int64_t>(t.balancings);
  stats.overflows += static_cast<std::int64_t>(t.overflows);
  stats.group_pairs = t.leaf_pairs;

  const gpu::StepCounters& c = counters_;
  // With a separation the filter is the last stage before the decision.
  const bool has_separation = options_.separation > 0;
  const auto sum = [](std::int64_t a, std::int64_t b) { return a + b; };
  stats.candidates_vf = static_cast<std::int64_t>(c.candidates[0]);
  stats.candidates_ee = static_cast<std::int64_t>(c.candidates[1]);
  stats.survivors_vf = has_separation ? c.filtered[0] : sum(c.hits[0], c.undecided_in_single[0]);
  stats.survivors_ee = has_separation ? c.filtered[1] : sum(c.hits[1], c.undecided_in_single[1]);
  // Only this filter lies between the two counts.
  if (step_.culling().non_penetration())
    stats.filtered_noncoplanar =
        stats.candidates_vf + stats.candidates_ee - sum(c.filtered[0], c.filtered[1]);
  const gpu::CullingCounters& culled = step_.culling().counters();
  stats.culled_by_volume = static_cast<std::int64_t>(culled.culled_by_volume);
  stats.culled_by_normal_cone = static_cast<std::int64_t>(culled.culled_by_normal_cone);
  stats.orphan_tests = culled.orphans;
  stats.double_precision_tests = c.double_precision_tests;
  stats.exact_tests = c.undecided_in_double;
  stats.hash = c.hash;
  stats.contacts_vf = c.contacts_vf;
  stats.contacts_ee = sum(c.contacts, 0) - c.contacts_vf;

  using gpu::Step;
  if (given_[0] != nullptr) stats.ms_upload = uploaded_[1].since(uploaded_[0]);
  stats.ms_device = step_.milliseconds(Step::kStart, Step::kSorted);
  if (!options_.algorithm.tuning.graph) {
    stats.ms_refit = step_.milliseconds(Step::kStart, Step::kRefitted);
    stats.ms_traverse = step_.milliseconds(Step::kRefitted, Step::kTraversed);
    stats.ms_leaf = step_.milliseconds(Step::kTraversed, Step::kFiltered);
    stats.ms_narrow = step_.milliseconds(Step::kFiltered, Step::kDecided);
    stats.ms_sort = step_.milliseconds(Step::kDecided, Step::kSorted);
  }
  stats.peak_bytes = static_cast<std::int64_t>(step_.bytes() + positions_.bytes() +
                                               active_.bytes() + published_.bytes());
}

}  // namespace

std::unique_ptr<DeviceBackend> make_gpu_detector(const DetectorOptions& options,
                                                 ThreadPool& threads) {
  gpu::require_device();
  return std::make_unique<GpuDetector>(options, threads);
}

}  // namespace lazyccd
