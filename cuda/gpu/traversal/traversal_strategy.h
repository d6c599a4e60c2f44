// How a traversal's work is spread over the device: one class a strategy, picked at run time.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "gpu/culling/node_culling.cuh"
#include "gpu/traversal/traversal_job.h"
#include "lazyccd/detector.h"

namespace lazyccd::gpu {

class TraversalStrategy {
 public:
  virtual ~TraversalStrategy() = default;

  // Whether it can start from a front and leaves one.
  virtual bool has_front() const = 0;
  // Whether launch() waits for the device, so that it cannot be captured.
  virtual bool asks_device() const { return false; }
  // Sizes grid and buffers for trees of so many nodes and for jobs with culling or without. What it
  // clears on the stream comes before the next launch there.
  virtual void reset(std::uint32_t node_count, bool culls, cudaStream_t stream) = 0;
  // Enqueues what comes before the job, apart from its input: its counters are cleared. Follows a
  // kernel.
  virtual void start(const TraversalJob& job, cudaStream_t stream) = 0;
  // Enqueues the job: no allocation, and unless asks_device() no synchronization and the same
  // launches for the same job.
  virtual void launch(const TraversalJob& job, const NodeCulling& culling, cudaStream_t stream) = 0;
  // The last run, which these are of, lost work. Throws where more room would not help.
  virtual void grow(const TraversalCounters& counters, cudaStream_t stream) = 0;
  virtual std::size_t bytes() const = 0;
};

std::unique_ptr<TraversalStrategy> make_lazy_stealing(const Tuning& tuning);
std::unique_ptr<TraversalStrategy> make_greedy_stealing(const Tuning& tuning);
std::unique_ptr<TraversalStrategy> make_static_list(const Tuning& tuning);
std::unique_ptr<TraversalStrategy> make_task_stealing(const Tuning& tuning);
std::unique_ptr<TraversalStrategy> make_guided(const Tuning& tuning);
std::unique_ptr<TraversalStrategy> make_thread_per_query(const Tuning& tuning);

}  // namespace lazyccd::gpu
