// An array of integers that threads lower at the same time.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "host/threads/thread_pool.h"

namespace lazyccd {

/// Integers with an atomic minimum. All accesses are relaxed: the end of a job of the pool orders
/// them. The minima do not depend on the order of the threads.
class SharedArray {
 public:
  /// Sets the size and all elements to `value`. `pool` is the pool whose threads change the array
  /// until the next call: if it is serial, the changes need no locked instruction.
  void assign(std::size_t size, std::uint32_t value, ThreadPool& pool) {
    is_shared_ = !pool.is_serial();
    if (size > capacity_) {
      items_.reset(new std::atomic<std::uint32_t>[size]);
      capacity_ = size;
    }
    pool.parallel_for(size, 1 << 15, [&](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) set(i, value);
    });
  }

  std::uint32_t operator[](std::size_t i) const {
    return items_[i].load(std::memory_order_relaxed);
  }
  void set(std::size_t i, std::uint32_t value) {
    items_[i].store(value, std::memory_order_relaxed);
  }
  /// Lowers an element to `value` if it is larger.
  void lower(std::size_t i, std::uint32_t value) {
    std::atomic<std::uint32_t>& item = items_[i];
    std::uint32_t old = item.load(std::memory_order_relaxed);
    if (!is_shared_) {
      if (value < old) item.store(value, std::memory_order_relaxed);
      return;
    }
    while (value < old && !item.compare_exchange_weak(old, value, std::memory_order_relaxed)) {
    }
  }

  std::size_t bytes() const { return capacity_ * sizeof(std::uint32_t); }

 private:
  bool is_shared_ = true;
  std::size_t capacity_ = 0;
  std::unique_ptr<std::atomic<std::uint32_t>[]> items_;
};

}  // namespace lazyccd
