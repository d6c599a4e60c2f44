// The atomics policy of the balancing protocols for CPU threads. The policy for CUDA blocks is in
// device_atomics.cuh.
//
// A policy defines the type of a cell, the memory orders that the protocols use, and the operations
// on a cell. A cell whose bytes are all zero holds zero.
#pragma once

#include <atomic>
#include <cstddef>

namespace lazyccd {

struct HostAtomics {
  template <class T>
  using Cell = std::atomic<T>;

  static constexpr std::memory_order relaxed = std::memory_order_relaxed;
  static constexpr std::memory_order acquire = std::memory_order_acquire;
  static constexpr std::memory_order release = std::memory_order_release;
  static constexpr std::memory_order acq_rel = std::memory_order_acq_rel;
  static constexpr std::memory_order seq_cst = std::memory_order_seq_cst;

  /// Alignment of cells that different workers write, in bytes: two cache lines, because x86
  /// prefetches lines in pairs.
  static constexpr std::size_t spacing = 128;
  static constexpr std::size_t line = spacing;  ///< the same for cells that all workers poll

  template <class T>
  static T load(const std::atomic<T>& cell, std::memory_order order) {
    return cell.load(order);
  }
  template <class T>
  static void store(std::atomic<T>& cell, T value, std::memory_order order) {
    cell.store(value, order);
  }
  template <class T>
  static T fetch_add(std::atomic<T>& cell, T value, std::memory_order order) {
    return cell.fetch_add(value, order);
  }
  template <class T>
  static T fetch_sub(std::atomic<T>& cell, T value, std::memory_order order) {
    return cell.fetch_sub(value, order);
  }
  /// Strong: fails only if the cell differs from `expected`; `expected` then receives its value.
  template <class T>
  static bool compare_exchange(std::atomic<T>& cell, T& expected, T desired,
                               std::memory_order success, std::memory_order failure) {
    return cell.compare_exchange_strong(expected, desired, success, failure);
  }
};

}  // namespace lazyccd
