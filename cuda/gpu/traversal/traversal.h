// The traversal on the device: from a tree with fitted boxes to the pairs of groups whose swept
// boxes overlap, each once, and to the front from which the next step can start.
//
//   traversal.reset(node_count, test, stream);  // once a tree; the front is forgotten
//   do {
//     traversal.start(from_front, stream);      // behind a kernel
//     traversal.launch(nodes, groups, culling, from_front, stream);  // capturable, see below
//     traversal.read_counters(stream);
//     cudaStreamSynchronize(stream);
//   } while (traversal.grow(stream));  // something did not fit: run it again
//   traversal.accept();                // the new front is the one to start from
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "gpu/device/device_buffer.h"
#include "gpu/device/pinned_buffer.h"
#include "gpu/traversal/traversal_job.h"
#include "gpu/traversal/traversal_strategy.h"
#include "lazyccd/detector.h"

namespace lazyccd {

// Uses the strategy, the front use and the tuning of the options. One at a time on one stream.
class Traversal {
 public:
  explicit Traversal(const DetectorOptions& options);

  // For another tree, and for launches with culling of nodes or without. Only this and grow()
  // allocate.
  void reset(std::uint32_t node_count, bool culls, cudaStream_t stream);

  // Whether launch() waits for the device; else it can be captured.
  bool asks_device() const { return strategy_->asks_device(); }
  // What comes before launch() with the same from_front, with whatever else between. Follows a kernel.
  void start(bool from_front, cudaStream_t stream);
  // nodes: of the tree of reset(), 16-byte aligned. groups: {} to keep every pair that overlaps.
  // culling: {} where reset() was told of none.
  // from_front only where has_front(). What is enqueued depends on the arguments and on parity()
  // alone, between two calls of reset() or of grow() that returned true.
  void launch(const TreeNode* nodes, const gpu::GroupView& groups,
              const gpu::NodeCulling& culling, bool from_front, cudaStream_t stream);
  bool has_front() const { return has_front_; }
  int parity() const { return parity_; }

  // Output of the launch, until accept(): pairs of group ids, the smaller first, in no particular
  // order.
  const NodePair* leaf_pairs() const { return leaf_pairs_.data(); }
  // On the device. More than the capacity where pairs did not fit.
  const std::uint32_t* leaf_pair_count() const { return &counters_.data()[parity_].leaf_pairs; }
  std::uint32_t leaf_pair_capacity() const {
    return static_cast<std::uint32_t>(leaf_pairs_.size());
  }
  const NodePair* front() const {
    return fronts_[parity_].data();
  }  // counters().front_nodes of them

  // Enqueues the download; counters() is valid once the stream is synchronized.
  void read_counters(cudaStream_t stream);
  const TraversalCounters& counters() const { return *host_counters_.data(); }
  // Of all blocks' time, the part without work.
  double idle_share() const;

  // By counters(): whether something did not fit. Then it has more room now, the outputs are lost,
  // and the front that the launch may have started from is untouched. Throws Error(device) where
  // more room does not help.
  bool grow(cudaStream_t stream);
  // The launch is good: its front, where one is kept, is where the next can start.
  void accept();

  std::size_t bytes() const;

 private:
  gpu::TraversalJob job(bool from_front);

  Tuning tuning_;
  std::unique_ptr<gpu::TraversalStrategy> strategy_;
  bool keep_front_;
  bool has_front_ = false;
  int parity_ = 0;  // which of the two fronts, and of their counters, the launch writes
  std::uint32_t node_count_ = 0;
  DeviceBuffer<NodePair> leaf_pairs_;
  DeviceBuffer<NodePair> fronts_[2];
  DeviceBuffer<NodePair> root_;
  DeviceBuffer<TraversalCounters> counters_;
  PinnedBuffer<TraversalCounters> host_counters_;
};

}  // namespace lazyccd
