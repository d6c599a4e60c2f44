// The stages of a step on the device. Each function enqueues its kernels. It allocates nothing,
// does not synchronize, and enqueues the same launches for the same arguments. So a step can be
// captured as a CUDA graph.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "core/bvh/node_pair.h"
#include "core/narrow/column_layout.h"
#include "gpu/scene/scene.cuh"

namespace lazyccd::gpu {

/// Clears the counters. This is a plain launch, which waits for all earlier work of the stream. The
/// refit of groups begins before the kernels ahead of it have ended, and relies on this wait: the
/// previous step is over.
void enqueue_start(StepCounters* counters, cudaStream_t stream);
/// Clears all counters but those of the refit, so that the stages behind the traversal can run
/// again.
void enqueue_restart(StepCounters* counters, cudaStream_t stream);

/// Computes the boxes of primitives, groups and nodes from the positions. Must be enqueued behind a
/// kernel.
void enqueue_refit(const SceneView& scene, const void* start, const void* end,
                   StepCounters* counters, cudaStream_t stream);

/// Pairs [first, last) of groups from a traversal, as far as there are so many.
struct LeafPairs {
  const NodePair* pairs;
  const std::uint32_t* count;
  std::uint32_t first, last;
};
/// Turns pairs of groups into the candidates that pass the non-penetration filter, if that is on.
void enqueue_leaf(const SceneView& scene, const LeafPairs& pairs, bool vertex_face, bool edge_edge,
                  bool non_penetration, const StepLists& lists, cudaStream_t stream);

/// Decides the candidates. Writes the contacts in no particular order, and lists the few queries
/// that only the host can decide.
void enqueue_narrow(const SceneView& scene, const StepLists& lists, cudaStream_t stream);
/// Decides exactly what double precision left open; only without a separation. Comes behind
/// enqueue_narrow(). many: whether many queries are likely, for which more blocks are launched.
void enqueue_exact(const SceneView& scene, const StepLists& lists, bool many, cudaStream_t stream);

/// Buffers of the sort. The arrays of keys, orders and contacts hold as many items as
/// StepLists::contacts; bin_starts holds one item per bin.
struct SortBuffers {
  std::uint64_t* sorted_keys;
  const std::uint32_t* order;  // 0, 1, 2, ...
  std::uint32_t* sorted_order;
  std::uint32_t* final_order;  // if a key is two words: the order by both
  std::uint32_t* bin_starts;
  void* space;
  std::size_t space_bytes;
  Contact* sorted;
};
/// Clears the bins or keys that the sort needs. Must come before all kernels of the step.
void prepare_sort(const SceneView& scene, const StepLists& lists, cudaStream_t stream);
/// Sorts the contacts of the lists by ContactKey into buffers.sorted.
void enqueue_sort(const SceneView& scene, const StepLists& lists, const SortBuffers& buffers,
                  cudaStream_t stream);
/// Lets enqueue_sort() run again, on more contacts.
void restore_keys(const SceneView& scene, const StepLists& lists, cudaStream_t stream);
/// Returns the number of bins for up to `contacts` contacts; 0: the sort uses no bins.
std::uint32_t sort_bins(const ContactKey& key, std::uint32_t contacts);
/// Returns the size of SortBuffers::space in bytes, at least 1.
std::size_t sort_space_bytes(std::uint32_t bins, std::uint32_t contacts);
/// Copies the fields of sorted contacts to arrays of their own, of as many as the layout has room
/// for.
void enqueue_columns(const Contact* sorted, std::uint32_t capacity, const std::uint32_t* count,
                     const ColumnLayout& layout, char* block, cudaStream_t stream);
/// Fills `order` with 0, 1, ..., count - 1.
void fill_order(std::uint32_t* order, std::uint32_t count, cudaStream_t stream);

}  // namespace lazyccd::gpu
