// The CUDA backend: runs the stages of a step on one stream, and merges the contacts that only the
// host can decide.
#include "gpu/gpu_detector.h"

#include <chrono>
#include <string>
#include <tuple>

#include "core/bvh/front_policy.h"
#include "cpu/scene/positions.h"
#include "cpu/threads/thread_pool.h"
#include "gpu/bvh/hierarchy_builder.h"
#include "gpu/culling/scene_culling.h"
#include "gpu/device/graph_cache.h"
#include "gpu/device/stream.h"
#include "gpu/narrow/undecided.h"
#include "gpu/scene/device_positions.h"
#include "gpu/scene/device_scene.h"
#include "gpu/scene/stages.h"
#include "gpu/scene/step_buffers.h"
#include "gpu/traversal/traversal.h"
#include "lazyccd/error.h"

namespace lazyccd {
namespace {

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

// Writes a version as CUDA numbers it: 12040 is 12.4.
std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

// Returns the device's name and the CUDA version that the driver supports.
std::string describe_device() {
  int device = 0, driver = 0;
  cudaDeviceProp properties;
  LAZYCCD_CUDA_CHECK(cudaGetDevice(&device));
  LAZYCCD_CUDA_CHECK(cudaGetDeviceProperties(&properties, device));
  LAZYCCD_CUDA_CHECK(cudaDriverGetVersion(&driver));
  return std::string(properties.name) + ", driver for CUDA " + version_text(driver);
}

// Turns FrontUse::automatic into on. A traversal from a front avoids the descent of the tree level
// by level.
DetectorOptions with_front(DetectorOptions options) {
  if (options.algorithm.front == FrontUse::automatic) options.algorithm.front = FrontUse::on;
  return options;
}

class GpuDetector : public BackendDetector {
 public:
  GpuDetector(const DetectorOptions& options, ThreadPool& threads)
      : options_(with_front(options)),
        device_name_(describe_device()),
        pool_(threads),
        scene_(options.separation),
        culling_(options),
        front_policy_(options.algorithm.front_period, options.algorithm.front_ratio),
        traversal_(options_),
        buffers_(options.algorithm.tuning.capacity_hint) {}

  void set_mesh(const Mesh& mesh) override {
    mesh_ = &mesh;
    scene_.set_mesh(mesh);
    culling_.set_mesh(mesh);
    positions_.forget();
    built_ = prepared_ = false;
  }

  Span<const Contact> detect(const Positions& start, const Positions& end, Stats& stats) override;

 private:
  // Times of a step, taken between its stages.
  enum Mark { kStart, kRefitted, kTraversed, kFiltered, kDecided, kSorted, kMarks };

  // The part of a step that one CUDA graph holds: the whole step, the kernels before or after the
  // traversal, or the build of the hierarchy.
  enum Part { kAll, kBefore, kAfter, kBuild };

  void build(const Positions& start, const Positions& end);
  void mark(Mark m, bool marks);
  void enqueue_before(bool from_front, bool marks);
  void enqueue_traversal(bool from_front, bool marks);
  void enqueue_after(bool marks);
  void run_until_it_fits(const Positions& start, const Positions& end, Stats& stats);
  void run_step(bool from_front);
  void fill(Stats& stats);

  DetectorOptions options_;
  std::string device_name_;
  gpu::Stream stream_;
  gpu::Event marks_[kMarks];
  gpu::Event uploaded_[2];
  ThreadPool& pool_;

  const Mesh* mesh_ = nullptr;
  bool prepared_ = false;  // all is allocated for trees of this mesh
  bool built_ = false;
  float built_area_ = 0;  // StepCounters::leaf_area of the first step after the build; 0: none yet
  gpu::DevicePositions positions_;
  gpu::DeviceScene scene_;
  gpu::HierarchyBuilder builder_;
  gpu::SceneCulling culling_;
  FrontPolicy front_policy_;
  Traversal traversal_;
  gpu::StepBuffers buffers_;
  // The key: part of the step, whether it starts from a front, Traversal::parity(), and whether the
  // positions are double.
  gpu::GraphCache<std::tuple<Part, bool, int, bool>> graphs_;
};

void GpuDetector::build(const Positions& start, const Positions& end) {
  const bool first = !prepared_, on_host = culling_.needs_host_tree();
  if (on_host) {
    scene_.build_on_host(start, end, pool_);
  } else if (first) {
    scene_.prepare();
    builder_.set_mesh(*mesh_, scene_);
  }
  if (first || on_host) {
    culling_.reserve(scene_.group_count(), scene_.node_count());
    if (on_host) culling_.set_tree(*mesh_, scene_.groups(), scene_.tree());
    traversal_.reset(scene_.node_count(), culling_.culls_nodes(), stream_);
    graphs_.clear();
  }
  prepared_ = true;
  if (!on_host) {
    const auto enqueue = [&] {
      builder_.enqueue(positions_.start(), positions_.is_double(), stream_);
    };
    // The first build of a mesh may be the last, so a graph would not pay.
    if (first || !options_.algorithm.tuning.graph) {
      enqueue();
    } else {
      graphs_.launch({kBuild, false, 0, positions_.is_double()}, stream_, enqueue);
    }
  }
  built_ = true;
  built_area_ = 0;
  traversal_.forget_front();
  front_policy_.forget();
}

void GpuDetector::mark(Mark m, bool marks) {
  if (marks) marks_[m].record(stream_);
}

void GpuDetector::enqueue_before(bool from_front, bool marks) {
  const gpu::SceneView scene = scene_.view(positions_.is_double());
  const gpu::StepLists lists = buffers_.lists();
  mark(kStart, marks);
  culling_.clear_counters(stream_);
  gpu::prepare_sort(scene, lists, stream_);
  gpu::enqueue_start(lists.counters, stream_);
  traversal_.start(from_front, stream_);
  gpu::enqueue_refit(scene, positions_.start(), positions_.end(), lists.counters, stream_);
  culling_.enqueue_refit(scene, stream_);
  mark(kRefitted, marks);
}

void GpuDetector::enqueue_traversal(bool from_front, bool marks) {
  const gpu::SceneView scene = scene_.view(positions_.is_double());
  traversal_.launch(scene.nodes, scene.groups, culling_.of_nodes(), from_front, stream_);
  mark(kTraversed, marks);
}

void GpuDetector::enqueue_after(bool marks) {
  const gpu::SceneView scene = scene_.view(positions_.is_double());
  const gpu::StepLists lists = buffers_.lists();
  gpu::enqueue_leaf(
      scene,
      {traversal_.leaf_pairs(), traversal_.leaf_pair_count(), traversal_.leaf_pair_capacity()},
      options_.vertex_face, options_.edge_edge, culling_.culls_candidates(),
      culling_.of_candidates(), lists, stream_);
  culling_.enqueue_orphans(scene, options_.vertex_face, options_.edge_edge, lists, stream_);
  mark(kFiltered, marks);
  gpu::enqueue_narrow(scene, lists, stream_);
  mark(kDecided, marks);
  gpu::enqueue_sort(scene, lists, buffers_.sort_buffers(), stream_);
  mark(kSorted, marks);
}

void GpuDetector::run_step(bool from_front) {
  const bool marks = !options_.algorithm.tuning.graph;
  const auto before = [&] { enqueue_before(from_front, marks); };
  const auto traversal = [&] { enqueue_traversal(from_front, marks); };
  const auto after = [&] { enqueue_after(marks); };
  const auto all = [&] { before(), traversal(), after(); };
  if (marks) {
    all();
    return;
  }
  const int parity = traversal_.parity();
  const bool is_double = positions_.is_double();
  marks_[kStart].record(stream_);
  if (traversal_.asks_device()) {  // launch() waits for the device: it cannot be captured
    graphs_.launch({kBefore, from_front, parity, is_double}, stream_, before);
    traversal();
    graphs_.launch({kAfter, from_front, parity, is_double}, stream_, after);
  } else {
    graphs_.launch({kAll, from_front, parity, is_double}, stream_, all);
  }
  marks_[kSorted].record(stream_);
}

void GpuDetector::run_until_it_fits(const Positions& start, const Positions& end, Stats& stats) {
  for (bool fits = false; !fits;) {
    buffers_.reserve(scene_.key(), stream_);
    run_step(stats.front_reused);
    traversal_.read_counters(stream_);
    buffers_.download(stream_);
    culling_.download(stream_);
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream_));
    const unsigned bad = buffers_.counters().bad_positions;
    if (bad != 0) built_ = false;  // perhaps from these positions
    if (bad & 1) check_finite(*mesh_, start, end);
    if (bad & 2) throw Error(ErrorCode::device, "positions beyond 2^100 need the CPU backend");
    const int grown_lists = traversal_.grow(stream_) + buffers_.grow();
    stats.overflows += grown_lists;
    fits = grown_lists == 0;
    if (!fits) graphs_.clear();
  }
}

Span<const Contact> GpuDetector::detect(const Positions& start, const Positions& end,
                                        Stats& stats) {
  const auto begin = std::chrono::steady_clock::now();
  check_counts(*mesh_, start, end);
  stats.backend = "cuda";
  stats.device = device_name_;
  if (mesh_->edges().empty()) return {};

  uploaded_[0].record(stream_);
  positions_.upload(start, end, pool_, stream_);
  uploaded_[1].record(stream_);
  stats.rebuilt = !built_ || options_.algorithm.rebuild_every_step;
  if (stats.rebuilt) build(start, end);
  if (!scene_.key().is_two_words())
    throw Error(ErrorCode::device, "millions of worlds and bodies need the CPU backend");
  stats.front_reused = traversal_.has_front() && front_policy_.reuse();
  run_until_it_fits(start, end, stats);
  traversal_.accept();
  fill(stats);

  const gpu::StepCounters& c = buffers_.counters();
  Contact* const contacts = buffers_.finish_contacts();
  std::size_t count = c.contacts;
  if (c.too_wide != 0)
    count = gpu::merge_undecided(*mesh_, start, end, buffers_.download_too_wide(), c.too_wide,
                                 pool_, contacts, count, stats);
  // If the area has grown beyond this ratio, the next step rebuilds the hierarchy.
  if (built_area_ == 0) built_area_ = c.leaf_area;
  if (c.leaf_area > options_.algorithm.rebuild_ratio * built_area_) built_ = false;
  stats.ms_total = milliseconds_since(begin);
  return {contacts, count};
}

void GpuDetector::fill(Stats& stats) {
  const TraversalCounters& t = traversal_.counters();
  front_policy_.saved(t.front_nodes, stats.front_reused);
  stats.groups = scene_.group_count();
  stats.tree_tests = static_cast<std::int64_t>(t.tree_tests);
  stats.front_nodes = static_cast<std::int64_t>(t.front_nodes);
  stats.idle_share = traversal_.idle_share();
  stats.steals = static_cast<std::int64_t>(t.steals);
  stats.balancings = static_cast<std::int64_t>(t.balancings);
  stats.overflows += static_cast<std::int64_t>(t.overflows);
  stats.group_pairs = t.leaf_pairs;

  const gpu::StepCounters& c = buffers_.counters();
  // With a separation the filter is the last stage before the decision.
  const bool has_separation = options_.separation > 0;
  stats.candidates_vf = c.candidates[0];
  stats.candidates_ee = c.candidates[1];
  stats.survivors_vf = has_separation ? c.filtered[0] : c.hits[0] + c.undecided_in_single[0];
  stats.survivors_ee = has_separation ? c.filtered[1] : c.hits[1] + c.undecided_in_single[1];
  // Only this filter lies between the two counts.
  if (culling_.non_penetration())
    stats.filtered_noncoplanar =
        stats.candidates_vf + stats.candidates_ee - c.filtered[0] - c.filtered[1];
  const gpu::CullingCounters& culled = culling_.counters();
  stats.culled_by_volume = static_cast<std::int64_t>(culled.culled_by_volume);
  stats.culled_by_normal_cone = static_cast<std::int64_t>(culled.culled_by_normal_cone);
  stats.orphan_tests = culled.orphans;
  stats.double_precision_tests = c.double_precision_tests;
  stats.exact_tests = c.undecided_in_double;
  stats.hash = c.hash;
  stats.contacts_vf = c.contacts_vf;
  stats.contacts_ee = c.contacts - c.contacts_vf;

  stats.ms_upload = uploaded_[1].since(uploaded_[0]);
  stats.ms_device = marks_[kSorted].since(marks_[kStart]);
  if (!options_.algorithm.tuning.graph) {
    stats.ms_refit = marks_[kRefitted].since(marks_[kStart]);
    stats.ms_traverse = marks_[kTraversed].since(marks_[kRefitted]);
    stats.ms_leaf = marks_[kFiltered].since(marks_[kTraversed]);
    stats.ms_narrow = marks_[kDecided].since(marks_[kFiltered]);
    stats.ms_sort = marks_[kSorted].since(marks_[kDecided]);
  }
  stats.peak_bytes =
      static_cast<std::int64_t>(scene_.bytes() + builder_.bytes() + culling_.bytes() +
                                positions_.bytes() + traversal_.bytes() + buffers_.bytes());
}

}  // namespace

std::unique_ptr<BackendDetector> make_gpu_detector(const DetectorOptions& options,
                                                   ThreadPool& threads) {
  int devices = 0, driver = 0;
  const cudaError_t result = cudaGetDeviceCount(&devices);
  // Without a driver the version is 0. With an old one, users want to know.
  if (result == cudaErrorInsufficientDriver && cudaDriverGetVersion(&driver) == cudaSuccess &&
      driver > 0)
    throw Error(ErrorCode::device, "the NVIDIA driver is for CUDA " + version_text(driver) +
                                       " and too old for this build, which needs CUDA " +
                                       version_text(CUDART_VERSION));
  if (result != cudaSuccess || devices == 0) {
    static_cast<void>(cudaGetLastError());
    throw Error(ErrorCode::unavailable,
                std::string("no CUDA device is available (") + cudaGetErrorString(result) + ")");
  }
  return std::make_unique<GpuDetector>(options, threads);
}

}  // namespace lazyccd
