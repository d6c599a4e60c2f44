// Interface of the strategies that distribute a traversal's work over the device: one class per
// strategy, chosen at run time.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "gpu/traversal/traversal_job.h"
#include "lazyccd/detector.h"
#include "lazyccd/export.h"

namespace lazyccd::gpu {

struct NodeCulling;  // gpu/scene/scene_culling.h

/// A strategy with its buffers. Used by Traversal.
class TraversalStrategy {
 public:
  virtual ~TraversalStrategy() = default;

  /// Whether it can start from a front and leaves one.
  virtual bool has_front() const = 0;
  /// Whether launch() waits for the device, so that it cannot be captured.
  virtual bool asks_device() const { return false; }
  /// Sizes grid and buffers for trees of node_count nodes. Memory is cleared on the stream, before
  /// the next launch there.
  virtual void reset(std::uint32_t node_count, cudaStream_t stream) = 0;
  /// Enqueues what must come before the job, and clears its counters. Needs neither nodes nor
  /// groups of the job. Must be enqueued behind a kernel.
  virtual void start(const TraversalJob& job, cudaStream_t stream) = 0;
  /// Enqueues the job. Allocates nothing. Unless asks_device(), it does not synchronize and
  /// enqueues the same launches for the same job. culling: read if the strategy culls nodes.
  virtual void launch(const TraversalJob& job, const NodeCulling* culling, cudaStream_t stream) = 0;
  /// Makes room after a run that lost work; `counters` are the counters of that run. Throws Error
  /// if more room would not help.
  virtual void grow(const TraversalCounters& counters, cudaStream_t stream) = 0;
  virtual std::size_t bytes() const = 0;
};

/// Makes Strategy::lazy_stealing without culling of nodes.
LAZYCCD_API std::unique_ptr<TraversalStrategy> make_lazy_stealing(const Tuning& tuning);

}  // namespace lazyccd::gpu
