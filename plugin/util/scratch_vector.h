// Vectors that a step needs for a while. Their memory is kept for the next ones, so that a step
// allocates nothing once it is warm.
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
/// system when the thread ends. A thread keeps no more blocks than it has taken, so none pile up
/// where vectors are made on one thread and end on another.
class ScratchBlocks {
 public:
  static void* take(std::size_t bytes) {
    if (is_sanitized) return ::operator new(bytes);
    SizeClass& blocks = of_this_thread().classes[size_class(bytes)];
    ++blocks.taken;
    if (!blocks.first) return ::operator new (std::size_t{1} << size_class(bytes));
    return std::exchange(blocks.first, blocks.first->next);
  }
  static void give_back(void* memory, std::size_t bytes) noexcept {
    Lists& lists = of_this_thread();
    SizeClass& blocks = lists.classes[size_class(bytes)];
    if (is_sanitized || lists.have_ended || blocks.taken == 0) return ::operator delete(memory);
    static thread_local const Owner owner{lists};
    --blocks.taken;
    blocks.first = new (memory) Block{blocks.first};
  }

 private:
  // With the address sanitizer each vector has memory of its own, of its exact size.
#if defined(__SANITIZE_ADDRESS__)
  static constexpr bool is_sanitized = true;
#elif defined(__has_feature)
  static constexpr bool is_sanitized = __has_feature(address_sanitizer);
#else
  static constexpr bool is_sanitized = false;
#endif

  struct Block {
    Block* next;
  };
  struct SizeClass {
    Block* first;
    std::size_t taken;  // and not given back on this thread
  };
  // Trivial, so that what lives longer than the owner may still ask it.
  struct Lists {
    std::array<SizeClass, 64> classes;
    bool have_ended;
  };
  struct Owner {
    Lists& lists;
    ~Owner() {
      for (SizeClass& blocks : lists.classes)
        while (blocks.first) ::operator delete(std::exchange(blocks.first, blocks.first->next));
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

/// Allocator of scratch vectors.
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
