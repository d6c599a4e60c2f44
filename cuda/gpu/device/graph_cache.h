// Cache of CUDA graphs: a step is launched as one graph, and captured again only if something it
// holds has changed.
#pragma once

#include <cuda_runtime_api.h>

#include <map>
#include <utility>

#include "gpu/device/check.h"
#include "gpu/device/stream.h"

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
    if (!graphs_.empty()) static_cast<void>(cudaDeviceSynchronize());  // one may be running
    for (const auto& entry : graphs_) static_cast<void>(cudaGraphExecDestroy(entry.second));
    graphs_.clear();
  }

  /// Launches the work that enqueue(s) puts on a stream s. enqueue() is called only if the key is
  /// new, with a stream of the cache: the default stream cannot be captured.
  template <class Enqueue>
  void launch(const Key& key, cudaStream_t stream, Enqueue&& enqueue) {
    auto found = graphs_.find(key);
    if (found == graphs_.end())
      found = graphs_.emplace(key, capture(std::forward<Enqueue>(enqueue))).first;
    LAZYCCD_CUDA_CHECK(cudaGraphLaunch(found->second, stream));
  }

 private:
  template <class Enqueue>
  cudaGraphExec_t capture(Enqueue&& enqueue) {
    const cudaStream_t stream = capture_stream_;
    cudaGraph_t graph = nullptr;
    try {
      LAZYCCD_CUDA_CHECK(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal));
      enqueue(stream);
    } catch (...) {  // the stream must not stay in capture
      static_cast<void>(cudaStreamEndCapture(stream, &graph));
      if (graph != nullptr) static_cast<void>(cudaGraphDestroy(graph));
      static_cast<void>(cudaGetLastError());
      throw;
    }
    LAZYCCD_CUDA_CHECK(cudaStreamEndCapture(stream, &graph));
    cudaGraphExec_t executable = nullptr;
    const cudaError_t result = cudaGraphInstantiateWithFlags(&executable, graph, 0);
    static_cast<void>(cudaGraphDestroy(graph));
    LAZYCCD_CUDA_CHECK(result);
    return executable;
  }

  Stream capture_stream_;
  std::map<Key, cudaGraphExec_t> graphs_;
};

}  // namespace lazyccd::gpu
