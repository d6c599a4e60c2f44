// The traversal on the device. From a tree with fitted boxes it finds the pairs of groups whose
// swept boxes overlap, each once, and the front from which the next step can start.
//
//   traversal.reset(node_count, stream);        // once per tree; forgets the front
//   do {
//     traversal.start(from_front, stream);       // behind a kernel
//     traversal.launch(nodes, groups, culling, from_front, stream);  // capturable, see below
//     traversal.read_counters(stream);
//     cudaStreamSynchronize(stream);
//   } while (traversal.grow(stream));  // something did not fit: run it again
//   traversal.accept();                // the next step can start from the new front
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

/// Runs the strategy that the options choose, with their front use and tuning. One run at a time,
/// on one stream.
class Traversal {
 public:
  explicit Traversal(const DetectorOptions& options);

  /// Prepares for another tree. Only this function and grow() allocate.
  void reset(std::uint32_t node_count, cudaStream_t stream);
  /// Prepares for another tree of as many nodes.
  void forget_front() { has_front_ = false; }

  /// Whether launch() waits for the device. If it does not, it can be captured.
  bool asks_device() const { return strategy_->asks_device(); }
  /// Enqueues what must come before launch() with the same from_front. Other work may come between
  /// the two. Must be enqueued behind a kernel.
  void start(bool from_front, cudaStream_t stream);
  /// Enqueues the traversal. nodes: of the tree of reset(), 16-byte aligned. groups: {} to keep
  /// every pair that overlaps. culling: null unless culls_nodes() of the options. from_front: only
  /// if has_front(). Between two calls of reset(), or of grow() that returned true, the enqueued
  /// work depends only on the arguments and on parity().
  void launch(const TreeNode* nodes, const gpu::GroupView& groups, const gpu::NodeCulling* culling,
              bool from_front, cudaStream_t stream);
  bool has_front() const { return has_front_; }
  int parity() const { return parity_; }

  /// The output of the launch, until accept(): pairs of group ids, the smaller first, in no
  /// particular order.
  const NodePair* leaf_pairs() const { return leaf_pairs_.data(); }
  /// The number of pairs, on the device. It exceeds the capacity if pairs did not fit.
  const std::uint32_t* leaf_pair_count() const { return &counters_.data()[parity_].leaf_pairs; }
  std::uint32_t leaf_pair_capacity() const {
    return static_cast<std::uint32_t>(leaf_pairs_.size());
  }
  std::uint32_t front_capacity() const {
    return keep_front_ ? static_cast<std::uint32_t>(fronts_[parity_].size()) : 0xffffffffu;
  }
  /// The counters of the launch, on the device.
  const TraversalCounters* launched_counters() const { return &counters_.data()[parity_]; }
  /// The front that the launch wrote: counters().front_nodes pairs.
  const NodePair* front() const { return fronts_[parity_].data(); }

  /// Enqueues the download; counters() is valid once the stream is synchronized.
  void read_counters(cudaStream_t stream);
  const TraversalCounters& counters() const { return *host_counters_.data(); }
  /// Returns the share of all blocks' time that they spent without work, 0 to 1.
  double idle_share() const;

  /// Returns whether something did not fit, judged by counters(). If so, there is more room now and
  /// the outputs are lost. The front that the launch may have started from is untouched. Throws
  /// Error(device) if more room does not help.
  bool grow(cudaStream_t stream);
  /// Accepts the launch. If fronts are kept, the next launch can start from its front.
  void accept();
  /// Takes the last accept() back, before which has_front() was `had_front`. So the launch can be
  /// repeated.
  void take_back(bool had_front);
  /// Works without fronts from now on, for lack of memory. Returns false if it does already. The
  /// next launch needs reset().
  bool drop_fronts();

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
