// The atomics policy of the balancing protocols for CUDA blocks. host_atomics.h has the policy for
// CPU threads and says what a policy is. Cells are plain memory (cudaMalloc, zeroed by cudaMemset).
#pragma once

#include <cstddef>
#include <cuda/atomic>

#include "core/platform.h"

namespace lazyccd {

struct DeviceAtomics {
  template <class T>
  using Cell = T;
  using Order = cuda::std::memory_order;

  static constexpr Order relaxed = cuda::std::memory_order_relaxed;
  static constexpr Order acquire = cuda::std::memory_order_acquire;
  static constexpr Order release = cuda::std::memory_order_release;
  static constexpr Order acq_rel = cuda::std::memory_order_acq_rel;
  static constexpr Order seq_cst = cuda::std::memory_order_seq_cst;

  /// Alignment of cells that different workers write, in bytes. Dense: atomics are done in the L2
  /// cache, where false sharing costs nothing, and a block that looks for a victim reads 16 deques
  /// in one line.
  static constexpr std::size_t spacing = 8;
  /// The same for cells that all workers poll. They are far apart, because polls of one cell queue
  /// up behind polls of its neighbours.
  static constexpr std::size_t line = 128;

  template <class T>
  using Ref = cuda::atomic_ref<T, cuda::thread_scope_device>;

  template <class T>
  LAZYCCD_HD static T load(const T& cell, Order order) {
    return Ref<T>(const_cast<T&>(cell)).load(order);
  }
  template <class T>
  LAZYCCD_HD static void store(T& cell, T value, Order order) {
    Ref<T>(cell).store(value, order);
  }
  template <class T>
  LAZYCCD_HD static T fetch_add(T& cell, T value, Order order) {
    return Ref<T>(cell).fetch_add(value, order);
  }
  template <class T>
  LAZYCCD_HD static T fetch_sub(T& cell, T value, Order order) {
    return Ref<T>(cell).fetch_sub(value, order);
  }
  template <class T>
  LAZYCCD_HD static bool compare_exchange(T& cell, T& expected, T desired, Order success,
                                          Order failure) {
    return Ref<T>(cell).compare_exchange_strong(expected, desired, success, failure);
  }
};

}  // namespace lazyccd
