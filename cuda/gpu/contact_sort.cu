#include "gpu/contact_sort.cuh"

#include <algorithm>
#include <cub/device/device_radix_sort.cuh>

#include "gpu/stages.h"

namespace lazyccd::gpu {
namespace {

constexpr std::uint32_t kBlock = 128;

// Up to here one kernel that compares all with all takes less than the launches of a sort.
bool few(const StepLists& lists) { return lists.contacts.capacity <= 4096; }

}  // namespace

std::size_t sort_space_bytes(std::uint32_t contacts) {
  std::size_t bytes = 0;
  const std::uint64_t* keys = nullptr;
  const std::uint32_t* order = nullptr;
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(nullptr, bytes, keys,
                                                     static_cast<std::uint64_t*>(nullptr), order,
                                                     static_cast<std::uint32_t*>(nullptr),
                                                     static_cast<int>(contacts)));
  return std::max<std::size_t>(bytes, 1);
}

void fill_order(std::uint32_t* order, std::uint32_t count, cudaStream_t stream) {
  number_places<<<blocks_for(count, 256), 256, 0, stream>>>(order, count);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
}

// Unused places hold keys of ones and, as they are behind all others, come behind them.
void prepare_sort(const StepLists& lists, cudaStream_t stream) {
  if (!few(lists))
    LAZYCCD_CUDA_CHECK(cudaMemsetAsync(lists.keys, 0xff,
                                       lists.contacts.capacity * sizeof(std::uint64_t), stream));
}

void enqueue_sort(const SceneView& scene, const StepLists& lists, const SortBuffers& buffers,
                  cudaStream_t stream) {
  if (few(lists)) {
    launch_behind(place_by_rank, 4 * multiprocessors(), kBlock, 0, stream, lists, buffers.sorted);
    return;
  }
  // The sort leaves primitive b to the placing, and takes 8 bits a pass: one bit more is no reason for
  // another pass.
  const int bits = scene.key.bits() - scene.key.b_bits;
  const int first_bit = scene.key.b_bits + (bits > 8 && bits % 8 == 1);
  std::size_t space = buffers.space_bytes;
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(
      buffers.space, space, lists.keys, buffers.sorted_keys, buffers.order, buffers.sorted_order,
      static_cast<int>(lists.contacts.capacity), first_bit, scene.key.bits(), stream));
  launch_behind(place_contacts, 4 * multiprocessors(), kBlock, 0, stream, lists, buffers.sorted_keys,
                buffers.sorted_order, first_bit, buffers.sorted);
}

}  // namespace lazyccd::gpu
