// The stages of a step. Each enqueues its kernels: no allocation, no synchronization, and the same
// launches for the same arguments, so that a step can be captured.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "core/node_pair.h"
#include "gpu/culling/leaf_culling.cuh"
#include "gpu/scene/scene.cuh"

namespace lazyccd::gpu {

// Clears the counters. A launch that waits for all before it on the stream: the boxes of groups,
// which begin ahead of the kernels before them, rely on it that the step before is over.
void enqueue_start(StepCounters* counters, cudaStream_t stream);

// Positions to the boxes of primitives, groups and nodes. Follows a kernel.
void enqueue_refit(const SceneView& scene, const void* start, const void* end,
                   StepCounters* counters, cudaStream_t stream);

// Pairs of groups from a traversal to candidates that the filter left. The count may exceed the
// capacity: then the step is run again.
struct LeafPairs {
  const NodePair* pairs;
  const std::uint32_t* count;
  std::uint32_t capacity;
};
void enqueue_leaf(const SceneView& scene, const LeafPairs& pairs, bool vertex_face, bool edge_edge,
                  bool culls, const LeafCulling& culling, const StepLists& lists,
                  cudaStream_t stream);

// Candidates to contacts, in no order, and to the residue.
void enqueue_narrow(const SceneView& scene, const StepLists& lists, cudaStream_t stream);

// Contacts to their order, with its own buffers: of as many items as contacts fit in the lists.
struct SortBuffers {
  std::uint64_t* sorted_keys;
  const std::uint32_t* order;  // 0, 1, 2, ...
  std::uint32_t* sorted_order;
  std::uint32_t* bin_starts;
  void* space;
  std::size_t space_bytes;
  Contact* sorted;
};
void prepare_sort(const SceneView& scene, const StepLists& lists,
                  cudaStream_t stream);  // before all
void enqueue_sort(const SceneView& scene, const StepLists& lists, const SortBuffers& buffers,
                  cudaStream_t stream);
// How many bins such contacts are counted into; 0: none.
std::uint32_t sort_bins(const ContactKey& key, std::uint32_t contacts);
std::size_t sort_space_bytes(std::uint32_t bins, std::uint32_t contacts);
void fill_order(std::uint32_t* order, std::uint32_t count, cudaStream_t stream);

}  // namespace lazyccd::gpu
