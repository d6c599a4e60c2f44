// Cache of CUDA graphs: a step is launched as one graph, and captured again only if something it
// holds has changed.
#pragma once

#include <cuda_runtime_api.h>

#include <map>
#include <utility>

#include "gpu/device/check.h"

namespace lazyccd::gpu {

/// Graphs by key. A key distinguishes the steps that use one set of addresses and capacities.
template <class Key>
class GraphCache {
 public:
  GraphCache() = default;
  ~GraphCache() { clear(); }
  GraphCache(const GraphCache&) = delete;
  GraphCache& operator=(const GraphCache&) = delete;

  /// Destroys all graphs; must be called once an address or a capacity has changed.
  void clear() {
    for (const auto& entry : graphs_) static_cast<void>(cudaGraphExecDestroy(entry.second));
    graphs_.clear();
  }

  /// Launches the work that enqueue() puts on the stream. enqueue() is called only if the key is
  /// new.
  template <class Enqueue>
  void launch(const Key& key, cudaStream_t stream, Enqueue&& enqueue) {
    auto found = graphs_.find(key);
    if (found == graphs_.end())
      found = graphs_.emplace(key, capture(stream, std::forward<Enqueue>(enqueue))).first;
    LAZYCCD_CUDA_CHECK(cudaGraphLaunch(found->second, stream));
  }

 private:
  template <class Enqueue>
  static cudaGraphExec_t capture(cudaStream_t stream, Enqueue&& enqueue) {
    cudaGraph_t graph = nullptr;
    LAZYCCD_CUDA_CHECK(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
    enqueue();
    LAZYCCD_CUDA_CHECK(cudaStreamEndCapture(stream, &graph));
    cudaGraphExec_t executable = nullptr;
    const cudaError_t result = cudaGraphInstantiateWithFlags(&executable, graph, 0);
    static_cast<void>(cudaGraphDestroy(graph));
    LAZYCCD_CUDA_CHECK(result);
    return executable;
  }

  std::map<Key, cudaGraphExec_t> graphs_;
};

}  // namespace lazyccd::gpu
