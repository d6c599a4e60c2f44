// Vectors that a function needs only while it runs. Their memory is kept for the next ones, so that
// a step allocates nothing once it is warm.
#pragma once

#include <array>
#include <cstddef>
#include <new>
#include <utility>
#include <vector>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Free blocks of memory of each thread, by size: powers of two, bytes. They are returned to the
/// system when the thread ends.
class ScratchBlocks {
 public:
  static void* take(std::size_t bytes) {
    Block*& first = of_this_thread().free[size_class(bytes)];
    if (!first) return ::operator new (std::size_t{1} << size_class(bytes));
    return std::exchange(first, first->next);
  }
  static void give_back(void* memory, std::size_t bytes) noexcept {
    Lists& lists = of_this_thread();
    if (lists.have_ended) return ::operator delete(memory);
    static thread_local const Owner owner{lists};
    Block*& first = lists.free[size_class(bytes)];
    first = new (memory) Block{first};
  }

 private:
  struct Block {
    Block* next;
  };
  // Trivial, so that what lives longer than the owner may still ask it.
  struct Lists {
    std::array<Block*, 64> free;
    bool have_ended;
  };
  struct Owner {
    Lists& lists;
    ~Owner() {
      for (Block*& first : lists.free)
        while (first) ::operator delete(std::exchange(first, first->next));
      lists.have_ended = true;
    }
  };

  static Lists& of_this_thread() {
    static thread_local Lists lists{};
    return lists;
  }
  static std::size_t size_class(std::size_t bytes) {
    std::size_t size = 6;  // most scratch vectors hold a value for each body
    while ((std::size_t{1} << size) < bytes) ++size;
    return size;
  }
};

/// Allocator of scratch vectors. A block may be given back on another thread; it stays there.
template <class T>
struct ScratchAllocator {
  using value_type = T;
  static_assert(alignof(T) <= __STDCPP_DEFAULT_NEW_ALIGNMENT__);

  ScratchAllocator() = default;
  template <class Other>
  ScratchAllocator(const ScratchAllocator<Other>&) {}

  T* allocate(std::size_t count) { return static_cast<T*>(ScratchBlocks::take(count * sizeof(T))); }
  void deallocate(T* memory, std::size_t count) noexcept {
    ScratchBlocks::give_back(memory, count * sizeof(T));
  }
  template <class Other>
  bool operator==(const ScratchAllocator<Other>&) const {
    return true;
  }
  template <class Other>
  bool operator!=(const ScratchAllocator<Other>&) const {
    return false;
  }
};

template <class T>
using ScratchVector = std::vector<T, ScratchAllocator<T>>;

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
