// The stages of a detection on the device as one unit: the scene, the lists of a step, and the
// launches. It reads positions in device memory and leaves sorted contacts there.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <tuple>

#include "gpu/bvh/hierarchy_builder.h"
#include "gpu/device/graph_cache.h"
#include "gpu/device/stream.h"
#include "gpu/scene/device_scene.h"
#include "gpu/scene/scene_culling.h"
#include "gpu/scene/stages.h"
#include "gpu/scene/step_buffers.h"
#include "gpu/traversal/traversal.h"
#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/detector.h"
#include "lazyccd/device.h"

namespace lazyccd::gpu {

/// Whether a step launches the exact stage. If no queries are expected it gets a few blocks, which
/// decide some queries just as well, but not many at a time.
enum class ExactStage { left_out, unexpected, expected };

/// What a step works on and how it runs.
struct StepInput {
  const void *start, *end;      // positions, three scalars per vertex
  bool is_double;               // their precision
  const unsigned char* active;  // per body, or null (SceneView::active)
  bool from_front;              // only if traversal().has_front()
  ExactStage exact;             // left_out with a separation
  DeviceStatus* status;         // where the step writes its status; may be null
};

/// Pairs of groups [first, last) of the traversal.
struct PairRange {
  std::uint32_t first, last;
};

/// Enqueues steps on a stream. Nothing here waits for the device but build(), grow() and
/// reserve_lists(), which allocate.
class Step {
 public:
  explicit Step(const DetectorOptions& options);

  /// Sets another mesh, as DeviceScene::set_mesh().
  void set_mesh(const Mesh& mesh, bool is_found);

  /// Builds the hierarchy from positions at the start of a step.
  void build(const StepInput& input, cudaStream_t stream);
  /// The same for options that need the tree on the host.
  void build_on_host(const Positions& start, const Positions& end, ThreadPool& pool,
                     cudaStream_t stream);
  bool needs_host_tree() const { return culling_ && culling_->needs_host_tree(); }
  /// Whether the options need the mesh's edges on the host.
  bool needs_host_edges() const { return culling_ && culling_->needs_host_edges(); }

  /// Allocates the lists. If memory does not suffice, they are shorter than wanted, and
  /// lists_are_limited().
  void reserve_lists(cudaStream_t stream);
  bool lists_are_limited() const { return limited_; }
  /// To be called once before each step: after some steps with limited lists they may grow again,
  /// because there may be memory by then.
  void retry_growth();

  /// Enqueues a whole step.
  void run(const StepInput& input, cudaStream_t stream);
  /// Enqueues the stages behind the traversal once more, for a part of its pairs.
  void run_pairs(const StepInput& input, PairRange range, cudaStream_t stream);
  /// Enqueues the exact stage behind a step that left it out, and sorts again.
  void run_exact(const StepInput& input, cudaStream_t stream);
  /// Enqueues the download of the counters, and of as many contacts as are likely.
  void download(cudaStream_t stream);
  /// Enqueues the download of the counters alone.
  void download_counters(cudaStream_t stream);

  /// Makes room after a run, judged by the downloaded counters. Both return how much was too small.
  int grow_traversal(cudaStream_t stream);
  int grow_lists();

  ContactKey key() const { return scene_.key(); }
  std::uint32_t group_count() const { return scene_.group_count(); }
  DeviceScene& scene() { return scene_; }
  Traversal& traversal() { return traversal_; }
  const SceneCulling* culling() const { return culling_.get(); }  ///< null: none
  StepBuffers& buffers() { return buffers_; }
  /// Milliseconds between two marks of the last step; valid once it is over.
  enum Mark { kStart, kRefitted, kTraversed, kFiltered, kDecided, kSorted, kMarks };
  double milliseconds(Mark from, Mark to) const { return marks_[to].since(marks_[from]); }
  std::size_t bytes() const;

 private:
  // The part of a step that one CUDA graph holds: the whole step, the kernels before or after the
  // traversal, or the build of the hierarchy.
  enum Part { kAll, kBefore, kAfter, kBuild };

  void prepare(bool first, cudaStream_t stream);
  template <class Enqueue>
  void launch_graph(Part part, const StepInput& input, cudaStream_t stream, Enqueue&& enqueue);
  SceneView view(const StepInput& input);
  void mark(Mark m, bool marks, cudaStream_t stream);
  void enqueue_before(const StepInput& input, bool marks, cudaStream_t stream);
  void enqueue_traversal(const StepInput& input, bool marks, cudaStream_t stream);
  void enqueue_after(const StepInput& input, PairRange range, bool marks, cudaStream_t stream);

  DetectorOptions options_;
  Event marks_[kMarks];
  const Mesh* mesh_ = nullptr;
  bool prepared_ = false;  // all is allocated for trees of this mesh
  bool limited_ = false;
  int limited_steps_ = 0;  // since memory was short
  bool is_new_ = false;    // no step has run with these addresses and capacities
  DeviceScene scene_;
  HierarchyBuilder builder_;
  std::unique_ptr<SceneCulling> culling_;  // null: none beyond boxes and the filter
  Traversal traversal_;
  StepBuffers buffers_;
  // The key: part of the step, Traversal::parity(), and the input.
  GraphCache<std::tuple<Part, int, bool, ExactStage, bool, const void*, const void*, const void*,
                        const void*>>
      graphs_;
};

}  // namespace lazyccd::gpu
