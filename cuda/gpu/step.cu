// The launches of a step, as CUDA graphs where they repeat.
#include "gpu/step.h"

#include <algorithm>
#include <utility>

#include "core/profile.h"
#include "gpu/device/check.h"
#include "gpu/traversal/extension.h"
#include "host/extension.h"

namespace lazyccd::gpu {
namespace {

constexpr PairRange kAllPairs{0, 0xffffffffu};

// Steps with limited lists before they may grow again. In vain, that costs a few allocations.
constexpr int kLimitedSteps = 16;

std::unique_ptr<SceneCulling> make_culling(const DetectorOptions& options) {
  if (!culls_nodes(options) && !excludes_pairs(options)) return nullptr;
  return find_extension(options.algorithm)->gpu->make_culling(options);
}

}  // namespace

Step::Step(const DetectorOptions& options)
    : options_(options),
      scene_(options.separation, options.reduce_contacts && options.vertex_face),
      culling_(make_culling(options)),
      traversal_(options),
      buffers_(options.algorithm.tuning.capacity_hint, options.separation > 0) {}

void Step::set_mesh(const Mesh& mesh, bool is_found) {
  mesh_ = &mesh;
  prepared_ = limited_ = false;
  scene_.set_mesh(mesh, is_found);
  if (culling_) culling_->set_mesh(mesh);
}

void Step::prepare(bool first, cudaStream_t stream) {
  if (first || needs_host_tree()) {
    if (culling_) culling_->reserve(scene_.group_count(), scene_.node_count());
    if (needs_host_tree()) culling_->set_tree(*mesh_, scene_.groups(), scene_.tree());
    graphs_.clear();
    is_new_ = true;
    const auto reset = [&] { traversal_.reset(scene_.node_count(), stream); };
    try {
      reset();
    } catch (const OutOfDeviceMemory&) {
      if (!traversal_.drop_fronts()) throw;
      reset();
    }
  }
  traversal_.forget_front();
  // The uploads of the host's tree go through another stream than the step, which does not wait for
  // it.
  if (needs_host_tree()) LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(cudaStreamLegacy));
  prepared_ = true;
}

template <class Enqueue>
void Step::launch_graph(Part part, const StepInput& input, cudaStream_t stream, Enqueue&& enqueue) {
  graphs_.launch({part, traversal_.parity(), input.from_front, input.exact, input.is_double,
                  input.start, input.end, input.active, input.status},
                 stream, enqueue);
}

void Step::build_on_host(const Positions& start, const Positions& end, ThreadPool& pool,
                         cudaStream_t stream) {
  scene_.build_on_host(start, end, pool);
  prepare(!prepared_, stream);
}

void Step::build(const StepInput& input, cudaStream_t stream) {
  const bool first = !prepared_;
  if (first) {
    scene_.prepare();
    builder_.set_mesh(*mesh_, scene_);
  }
  prepare(first, stream);
  const auto enqueue = [&](cudaStream_t s) { builder_.enqueue(input.start, input.is_double, s); };
  // The first build of a mesh may be the last, so a graph would not pay.
  if (first || !options_.algorithm.tuning.graph) {
    enqueue(stream);
  } else {
    launch_graph(kBuild, input, stream, enqueue);
  }
}

void Step::reserve_lists(cudaStream_t stream) {
  for (;;) {
    try {
      buffers_.reserve(scene_.key(), stream);
      return;
    } catch (const OutOfDeviceMemory&) {
      graphs_.clear();
      limited_ = true;
      limited_steps_ = 0;
      if (!buffers_.shrink()) throw;
    }
  }
}

void Step::retry_growth() {
  if (limited_ && ++limited_steps_ >= kLimitedSteps) limited_ = false;
}

SceneView Step::view(const StepInput& input) {
  SceneView view = scene_.view(input.is_double);
  view.active = input.active;
  return view;
}

void Step::mark(Mark m, bool marks, cudaStream_t stream) {
  if (marks) marks_[m].record(stream);
}

void Step::enqueue_before(const StepInput& input, bool marks, cudaStream_t stream) {
  LAZYCCD_NVTX_RANGE("refit");
  const SceneView scene = view(input);
  const StepLists lists = buffers_.lists();
  mark(kStart, marks, stream);
  if (culling_) culling_->clear_counters(stream);
  prepare_sort(scene, lists, stream);
  if (options_.separation > 0) scene_.clear_near_distances(stream);
  enqueue_start(lists.counters, stream);
  traversal_.start(input.from_front, stream);
  enqueue_refit(scene, input.start, input.end, lists.counters, stream);
  if (culling_) culling_->enqueue_refit(scene, stream);
  mark(kRefitted, marks, stream);
}

void Step::enqueue_traversal(const StepInput& input, bool marks, cudaStream_t stream) {
  LAZYCCD_NVTX_RANGE("traverse");
  const SceneView scene = view(input);
  traversal_.launch(scene.nodes, scene.groups, culling_ ? culling_->of_nodes() : nullptr,
                    input.from_front, stream);
  mark(kTraversed, marks, stream);
}

void Step::enqueue_after(const StepInput& input, PairRange range, bool marks, cudaStream_t stream) {
  const SceneView scene = view(input);
  StepLists lists = buffers_.lists();
  lists.report = {input.status, traversal_.launched_counters(), traversal_.leaf_pair_capacity(),
                  traversal_.front_capacity()};
  const std::uint32_t last = std::min(range.last, traversal_.leaf_pair_capacity());
  const LeafPairs pairs{traversal_.leaf_pairs(), traversal_.leaf_pair_count(), range.first, last};
  if (!culling_ || !culling_->enqueue_leaf(scene, pairs, options_.vertex_face, options_.edge_edge,
                                           lists, stream))
    enqueue_leaf(scene, pairs, options_.vertex_face, options_.edge_edge,
                 options_.algorithm.culling.non_penetration, lists, stream);
  mark(kFiltered, marks, stream);
  {
    LAZYCCD_NVTX_RANGE("elementary tests");
    enqueue_narrow(scene, lists, stream);
    if (input.exact != ExactStage::left_out)
      enqueue_exact(scene, lists, input.exact == ExactStage::expected, stream);
  }
  mark(kDecided, marks, stream);
  LAZYCCD_NVTX_RANGE("sort");
  enqueue_sort(scene, lists, buffers_.sort_buffers(), stream);
  mark(kSorted, marks, stream);
}

void Step::run(const StepInput& input, cudaStream_t stream) {
  if (scene_.reserve_records(input.is_double)) graphs_.clear();
  if (options_.separation > 0) scene_.update_resting(stream);
  const bool marks = !options_.algorithm.tuning.graph;
  const auto before = [&](cudaStream_t s) { enqueue_before(input, marks, s); };
  const auto traversal = [&](cudaStream_t s) { enqueue_traversal(input, marks, s); };
  const auto after = [&](cudaStream_t s) { enqueue_after(input, kAllPairs, marks, s); };
  const auto all = [&](cudaStream_t s) { before(s), traversal(s), after(s); };
  if (marks) {
    all(stream);
    return;
  }
  marks_[kStart].record(stream);
  if (std::exchange(is_new_, false)) {
    all(stream);  // perhaps the only run of this kind, and a graph takes longer to make than a run
  } else if (traversal_.asks_device()) {  // launch() waits for the device: it cannot be captured
    launch_graph(kBefore, input, stream, before);
    traversal(stream);
    launch_graph(kAfter, input, stream, after);
  } else {
    launch_graph(kAll, input, stream, all);
  }
  marks_[kSorted].record(stream);
}

void Step::run_pairs(const StepInput& input, PairRange range, cudaStream_t stream) {
  const StepLists lists = buffers_.lists();
  if (culling_) culling_->clear_leaf_counters(stream);
  prepare_sort(view(input), lists, stream);
  enqueue_restart(lists.counters, stream);
  enqueue_after(input, range, false, stream);
  marks_[kSorted].record(stream);
}

void Step::run_exact(const StepInput& input, cudaStream_t stream) {
  const SceneView scene = view(input);
  const StepLists lists = buffers_.lists();
  restore_keys(scene, lists, stream);
  enqueue_exact(scene, lists, true, stream);
  enqueue_sort(scene, lists, buffers_.sort_buffers(), stream);
  marks_[kSorted].record(stream);
}

void Step::download(cudaStream_t stream) {
  traversal_.read_counters(stream);
  buffers_.download(stream);
  if (options_.separation > 0) scene_.download_near_distances(stream);
  if (culling_) culling_->download(stream);
}

void Step::download_counters(cudaStream_t stream) {
  traversal_.read_counters(stream);
  buffers_.download_counters(stream);
}

int Step::grow_traversal(cudaStream_t stream) {
  if (!traversal_.grow(stream)) return 0;
  graphs_.clear();
  is_new_ = true;
  return 1;
}

int Step::grow_lists() {
  const int grown = buffers_.grow(!limited_);
  if (grown != 0) {
    graphs_.clear();
    is_new_ = true;
  }
  return grown;
}

std::size_t Step::bytes() const {
  return scene_.bytes() + (culling_ ? culling_->bytes() : 0) + traversal_.bytes() +
         buffers_.bytes();
}

}  // namespace lazyccd::gpu
