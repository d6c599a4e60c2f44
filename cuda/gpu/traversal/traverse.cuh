// The persistent traversal of a block (da Silva, Algorithms 3.7 and 3.8). In every round each
// thread pops a pair of nodes from the block's shared stack and tests it. The results stay in
// registers until a prefix sum over the block gives their places in the stack, in the front and in
// the list of leaf pairs.
//
// The template parameter Balancing determines how a block with an empty stack finds more work, and
// how a block gives work away:
//
//   Balancing::View                     passed to the kernel
//   Balancing::keeps_time               whether it adds to job.counters' cycles itself
//   start(view, job)                    one thread, in an earlier kernel
//   leaving(shape, size, asked)         number of pairs that leave a stack, the oldest first;
//                                       called by all threads with the same result
//   by thread 0, with the object in shared memory:
//     arrive(view, job)
//     own_batch()                       work that needs no waiting; count 0: none
//     release(batch)                    the batch has been copied
//     asked(view)                       whether others want work of this block; a load or two
//     room(wanted)                      space for up to `wanted` leaving pairs; count 0: they stay
//     publish(view, count)              `count` pairs have been written to that space
//   by the first warp:
//     wait_for_batch(view, job, batch)  work of other blocks; count 0: all is done
//   by all threads:
//     leave(view, job)                  after the last round
#pragma once

#include <cstddef>
#include <cstdint>

#include "balance/chunk_pool.h"
#include "gpu/device/kernel_chain.cuh"
#include "gpu/traversal/traversal_job.h"

namespace lazyccd::gpu {

constexpr unsigned kMaxTraversalBlock = 512;

struct NodeCulling;  // gpu/scene/scene_culling.h

/// Nodes are ruled out by their boxes alone.
struct NoCulling {
  static constexpr bool is_used = false;
  struct Counts {};  // of one thread

  static NoCulling of(const NodeCulling*) { return {}; }
};

/// The shape of a block's stack. The stack is a ring, so that its oldest pairs can leave too.
struct StackShape {
  std::uint32_t capacity;  // a power of two, at least batch + reserve + 2
  std::uint32_t reserve;   // for a depth-first walk, one pair per round, if all else is full
  std::uint32_t crowded;   // beyond this size the oldest pairs leave
  std::uint32_t keep;      // a block with fewer pairs has no surplus to give away
  std::uint32_t batch;     // most pairs that leave at once
};

/// Space for pairs that leave a block's stack.
struct Room {
  NodePair* pairs;
  std::uint32_t count;
};

/// Returns the number of pairs that the traversal starts from.
__device__ inline std::uint32_t initial_count(const TraversalJob& job) {
  if (job.initial_counters != nullptr) return job.initial_counters->front_nodes;
  return job.node_count == 0 ? 0 : 1;
}

__device__ inline TreeNode load_node(const TreeNode* nodes, std::uint32_t i) {
  const auto* halves = reinterpret_cast<const float4*>(nodes + i);
  const float4 u = __ldg(halves), v = __ldg(halves + 1);
  return {{u.x, u.y, u.z}, {u.w, v.x, v.y}, __float_as_int(v.z), __float_as_int(v.w)};
}

/// Waits a random time of less than job.delay_ns, for tests.
__device__ inline void random_delay(const TraversalJob& job) {
  if (job.delay_ns == 0) return;
  std::uint32_t x = static_cast<std::uint32_t>(clock64()) ^ (blockIdx.x * 0x9e3779b9u) ^
                    (threadIdx.x / 32 * 0x85ebca6bu);
  x = (x ^ x >> 16) * 0x7feb352du;
  x ^= x >> 15;
  __nanosleep(x % job.delay_ns);
}

/// The three counts of a round in one word. A block of 512 threads makes at most 1536 children, 512
/// ended pairs and 512 leaf pairs.
struct Made {
  __device__ static std::uint32_t pack(std::uint32_t children, std::uint32_t ended,
                                       std::uint32_t leaves) {
    return children | ended << 11 | leaves << 21;
  }
  __device__ static std::uint32_t children(std::uint32_t made) { return made & 0x7ffu; }
  __device__ static std::uint32_t ended(std::uint32_t made) { return made >> 11 & 0x3ffu; }
  __device__ static std::uint32_t leaves(std::uint32_t made) { return made >> 21; }
};

/// Reserves output for `ended` pairs of the front (upper half of the result) and for `leaves` leaf
/// pairs (lower half).
__device__ inline unsigned long long reserve_output(const TraversalJob& job, std::uint32_t ended,
                                                    std::uint32_t leaves) {
  static_assert(offsetof(TraversalCounters, leaf_pairs) == 0 &&
                offsetof(TraversalCounters, front_nodes) == 4);
  if (ended == 0) return 0;
  return atomicAdd(reinterpret_cast<unsigned long long*>(job.counters),
                   static_cast<unsigned long long>(ended) << 32 | leaves);
}

__device__ inline void add(std::uint64_t& counter, std::uint64_t value) {
  if (value != 0)
    atomicAdd(reinterpret_cast<unsigned long long*>(&counter),
              static_cast<unsigned long long>(value));
}

__device__ inline void store_leaf_pair(const TraversalJob& job, std::uint32_t at, std::int32_t a,
                                       std::int32_t b) {
  if (at < job.leaf_pair_capacity)
    job.leaf_pairs[at] = {static_cast<std::uint32_t>(min(a, b)),
                          static_cast<std::uint32_t>(max(a, b))};
}

/// The result of a thread's pair of the last round, until it has a place in global memory. The
/// addition that reserves the place runs while the next pairs are tested.
struct Ended {
  NodePair pair;
  std::int32_t group_a, group_b;
  std::uint32_t place, leaf_place;  // index in the block's output, or none
  static constexpr std::uint32_t none = 0xffffffffu;

  __device__ void store(const TraversalJob& job, unsigned long long base) const {
    if (place != none && job.front != nullptr) {
      const std::uint32_t at = static_cast<std::uint32_t>(base >> 32) + place;
      if (at < job.front_capacity) job.front[at] = pair;
    }
    if (leaf_place != none)
      store_leaf_pair(job, static_cast<std::uint32_t>(base) + leaf_place, group_a, group_b);
  }
};

/// Replaces a front that lacks pairs by the root with itself. The host asks for a front before it
/// knows whether the run that left it had room for all of it.
__device__ inline void check_front(const TraversalJob& job) {
  if (job.initial_counters == nullptr) return;
  if (job.initial_counters->front_nodes <= job.initial_capacity && job.initial_counters->lost == 0)
    return;
  job.initial[0] = {0, 0};
  job.initial_counters->front_nodes = 1;
  job.initial_counters->lost = 0;
}

/// Prepares a run, by one thread: clears the job's counters and starts the balancing.
template <class Balancing>
__global__ void start_traversal(typename Balancing::View view, TraversalJob job) {
  let_next_kernel_in();
  await_kernels_before();
  check_front(job);
  *job.counters = {};
  Balancing::start(view, job);
}

/// The traversal. Balancing: see above. Culling: NoCulling, or a class with the same members and
/// with is_used.
template <class Balancing, class Culling>
__global__ void __launch_bounds__(kMaxTraversalBlock, 2)
    traverse(typename Balancing::View view, TraversalJob job, StackShape shape, Culling culling) {
  begin_kernel();
  extern __shared__ NodePair stack[];
  // Used by thread 0, apart from what it tells the others. Each variable is written and read on
  // different sides of a barrier.
  __shared__ Balancing balancing;
  __shared__ Batch<NodePair> own, others;
  __shared__ Room room;
  __shared__ unsigned long long output;  // place of the last round's output
  __shared__ bool asked;
  __shared__ std::uint32_t made_by_parity[2];
  __shared__ std::uint64_t tests, idle, lost;
  __shared__ long long arrival;

  const std::uint32_t thread = threadIdx.x, threads = blockDim.x;
  const unsigned lane = thread % 32, below = (1u << lane) - 1;
  const std::uint32_t mask = shape.capacity - 1;
  // The same in all threads. The stack is [bottom, top) modulo its capacity. `made` counts what the
  // last round made and has not stored.
  std::uint32_t bottom = 0, top = 0, made = 0, round = 0;
  Ended ended{{0, 0}, 0, 0, Ended::none, Ended::none};
  [[maybe_unused]] typename Culling::Counts culled;

  if (thread == 0) {
    tests = idle = lost = 0;
    arrival = clock64();
    made_by_parity[0] = made_by_parity[1] = 0;
    balancing.arrive(view, job);
  }

  for (;;) {
    if (top == bottom) {
      if (thread == 0) {
        random_delay(job);
        const unsigned long long base = reserve_output(job, Made::ended(made), Made::leaves(made));
        own = balancing.own_batch();
        output = base;
      }
      __syncthreads();
      ended.store(job, output);
      ended.place = ended.leaf_place = Ended::none;
      made = 0;
      Batch<NodePair> batch = own;
      if (batch.count == 0) {
        if (thread < 32) {
          const long long since = clock64();
          if (thread == 0) {
            add(job.counters->tree_tests, tests);
            tests = 0;
          }
          balancing.wait_for_batch(view, job, others);
          if (thread == 0) idle += static_cast<std::uint64_t>(clock64() - since);
        }
        __syncthreads();
        batch = others;
        if (batch.count == 0) break;
      }
      for (std::uint32_t i = thread; i < batch.count; i += threads)
        stack[(bottom + i) & mask] = batch.items[i];
      top = bottom + batch.count;
      __syncthreads();
      if (thread == 0) balancing.release(batch);
    }

    const std::uint32_t size = top - bottom;
    if (size + 2 > shape.capacity) {
      // The tree is too deep for the reserve, and no other block has room. The host makes more
      // room.
      if (thread == 0) lost += size;
      top = bottom;
      continue;
    }
    // A pair makes at most three pairs.
    const std::uint32_t max_tests =
        size + shape.reserve < shape.capacity ? (shape.capacity - shape.reserve - size) / 2 : 0;
    const std::uint32_t count = min(min(size, threads), max(max_tests, 1u));
    const std::uint32_t floor = top - count;

    // Both results are needed only after the tests, so the round trip to L2 costs nothing.
    unsigned long long base = 0;
    bool is_asked = false;
    if (thread == 0) {
      // At the end of a run most blocks have so few pairs that none would leave.
      if (size + 2 * count > shape.keep) is_asked = balancing.asked(view);
      base = reserve_output(job, Made::ended(made), Made::leaves(made));
    }
    const bool active = thread < count;
    NodePair pair{0, 0};
    std::int32_t group_a = 0, group_b = 0;
    PairVisit visited{false, 0, {}};
    if (active) {
      pair = stack[(top - 1 - thread) & mask];
      const TreeNode a = load_node(job.nodes, pair.a), b = load_node(job.nodes, pair.b);
      visited = visit(pair, a, b);
      if constexpr (Culling::is_used) visited = culled.cull(culling, pair, visited);
      group_a = a.group();
      group_b = b.group();
    }
    random_delay(job);
    const bool ends = active && visited.children == 0;
    bool leaf = ends && visited.overlaps && job.groups.opens(group_a, group_b);
    if constexpr (Culling::is_used) leaf = leaf && !culled.leaves_apart(culling, pair);
    const unsigned opened = __ballot_sync(kAllLanes, visited.children != 0);
    const unsigned self_pairs = __ballot_sync(kAllLanes, visited.children == 3);
    const unsigned ends_here = __ballot_sync(kAllLanes, ends);
    const unsigned leaves_here = __ballot_sync(kAllLanes, leaf);
    std::uint32_t before = 0;  // made by faster warps
    if (lane == 0 && (opened | ends_here) != 0)
      before =
          atomicAdd(&made_by_parity[round % 2], Made::pack(2 * __popc(opened) + __popc(self_pairs),
                                                           __popc(ends_here), __popc(leaves_here)));
    before = __shfl_sync(kAllLanes, before, 0);
    if (thread == 0) {
      output = base;
      asked = is_asked;
    }
    __syncthreads();  // all have popped; `output` and `asked` are set

    ended.store(job, output);
    bool surplus_wanted = asked;
    std::uint32_t at =
        floor + Made::children(before) + 2 * __popc(opened & below) + __popc(self_pairs & below);
    for (int i = 0; i < 3; ++i)
      if (i < visited.children) stack[at++ & mask] = visited.child[i];
    ended.pair = pair;
    ended.group_a = group_a;
    ended.group_b = group_b;
    ended.place = ends ? Made::ended(before) + __popc(ends_here & below) : Ended::none;
    ended.leaf_place = leaf ? Made::leaves(before) + __popc(leaves_here & below) : Ended::none;
    // The other counter was last read before the barrier above. It is next added to after the
    // barrier below.
    if (thread == 0) {
      made_by_parity[(round + 1) % 2] = 0;
      tests += count;
    }
    __syncthreads();  // all have pushed and counted

    made = made_by_parity[round % 2];
    ++round;
    top = floor + Made::children(made);

    // The oldest pairs, which head the largest subtrees, leave as long as there is a reason.
    for (;;) {
      const std::uint32_t left = top - bottom;
      const std::uint32_t wanted = Balancing::leaving(shape, left, surplus_wanted);
      if (wanted == 0) break;
      surplus_wanted = false;
      if (thread == 0) {
        random_delay(job);
        room = balancing.room(wanted);
      }
      __syncthreads();
      const Room out = room;
      if (out.count == 0) break;
      for (std::uint32_t i = thread; i < out.count; i += threads)
        out.pairs[i] = stack[(bottom + i) & mask];
      bottom += out.count;
      __syncthreads();
      if (thread == 0) balancing.publish(view, out.count);
    }
  }

  balancing.leave(view, job);
  if constexpr (Culling::is_used) culled.add_to(*culling.counters);
  if (thread != 0) return;
  add(job.counters->lost, lost);
  if (Balancing::keeps_time) return;
  add(job.counters->idle_cycles, idle);
  add(job.counters->cycles, static_cast<std::uint64_t>(clock64() - arrival));
}

}  // namespace lazyccd::gpu
