// Sort of the contacts: all pairs compared, a counting sort, or a radix sort, depending on their
// number.
#include "gpu/narrow/contact_sort.cuh"

#include <algorithm>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "gpu/scene/stages.h"

namespace lazyccd::gpu {
namespace {

constexpr std::uint32_t kBlock = 128;

// Up to this many contacts, one kernel that compares all pairs takes less time than the launches of
// a sort.
bool fits_one_kernel(std::uint32_t contacts) { return contacts <= 4096; }

// With more bits, clearing and summing the bins takes longer than a radix sort.
constexpr int kMaxBinBits = 21;

std::size_t bin_space(std::uint32_t bins) {
  std::size_t bytes = 0;
  std::uint32_t* counts = nullptr;
  LAZYCCD_CUDA_CHECK(
      cub::DeviceScan::ExclusiveSum(nullptr, bytes, counts, counts, static_cast<int>(bins)));
  return bytes;
}

std::size_t radix_space(std::uint32_t contacts) {
  std::size_t bytes = 0;
  const std::uint64_t* keys = nullptr;
  const std::uint32_t* order = nullptr;
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(
      nullptr, bytes, keys, static_cast<std::uint64_t*>(nullptr), order,
      static_cast<std::uint32_t*>(nullptr), static_cast<int>(contacts)));
  return bytes;
}

}  // namespace

std::uint32_t sort_bins(const ContactKey& key, std::uint32_t contacts) {
  const int bits = key.bits() - key.b_bits;  // more than the limit if the key is two words
  return fits_one_kernel(contacts) || bits > kMaxBinBits ? 0 : 1u << bits;
}

std::size_t sort_space_bytes(std::uint32_t bins, std::uint32_t contacts) {
  return std::max<std::size_t>(bins != 0 ? bin_space(bins) : radix_space(contacts), 1);
}

void fill_order(std::uint32_t* order, std::uint32_t count, cudaStream_t stream) {
  number_places<<<blocks_for(count, 256), 256, 0, stream>>>(order, count);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
}

void enqueue_columns(const Contact* sorted, std::uint32_t capacity, const std::uint32_t* count,
                     const ColumnLayout& layout, char* block, cudaStream_t stream) {
  split_contacts<<<blocks_for(layout.places, kBlock), kBlock, 0, stream>>>(sorted, capacity, count,
                                                                           layout, block);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
}

void prepare_sort(const SceneView& scene, const StepLists& lists, cudaStream_t stream) {
  if (const std::uint32_t bins = sort_bins(scene.key, lists.contacts.capacity)) {
    LAZYCCD_CUDA_CHECK(cudaMemsetAsync(lists.bins, 0, bins * sizeof(std::uint32_t), stream));
  } else if (!fits_one_kernel(lists.contacts.capacity)) {
    // Unused places hold keys of all ones. They lie behind all used places, so they also come
    // behind them in the sorted order.
    LAZYCCD_CUDA_CHECK(
        cudaMemsetAsync(lists.keys, 0xff, lists.contacts.capacity * sizeof(std::uint64_t), stream));
    if (lists.upper_keys != nullptr)
      LAZYCCD_CUDA_CHECK(cudaMemsetAsync(lists.upper_keys, 0xff,
                                         lists.contacts.capacity * sizeof(std::uint64_t), stream));
  }
}

// Sorts by the lower words of the keys, then by the upper words; both sorts are stable. Unused
// places are all ones in the sorted bits of both words.
static void sort_by_two_words(const SceneView& scene, const StepLists& lists,
                              const SortBuffers& buffers, cudaStream_t stream) {
  const std::uint32_t grid = 4 * multiprocessors(), capacity = lists.contacts.capacity;
  const auto sort = [&](const std::uint64_t* keys, std::uint64_t* sorted_keys,
                        const std::uint32_t* order, std::uint32_t* sorted_order, int bits) {
    std::size_t space = buffers.space_bytes;
    LAZYCCD_CUDA_CHECK(
        cub::DeviceRadixSort::SortPairs(buffers.space, space, keys, sorted_keys, order,
                                        sorted_order, static_cast<int>(capacity), 0, bits, stream));
  };
  sort(lists.keys, buffers.sorted_keys, buffers.order, buffers.sorted_order,
       scene.key.lower_bits());
  // The lower words are no longer needed, so their arrays take the upper words, in both orders.
  launch_behind(gather_upper_keys, grid, kBlock, 0, stream, lists.upper_keys, buffers.sorted_order,
                capacity, lists.keys);
  sort(lists.keys, buffers.sorted_keys, buffers.sorted_order, buffers.final_order,
       scene.key.upper_bits());
  launch_behind(place_in_order, grid, kBlock, 0, stream, lists, buffers.final_order,
                buffers.sorted);
}

void restore_keys(const SceneView& scene, const StepLists& lists, cudaStream_t stream) {
  if (lists.upper_keys == nullptr || fits_one_kernel(lists.contacts.capacity)) return;
  launch_behind(write_lower_keys, 4 * multiprocessors(), kBlock, 0, stream, scene, lists);
}

// The counting sort and the radix sort ignore primitive b; place_contacts() orders by it.
void enqueue_sort(const SceneView& scene, const StepLists& lists, const SortBuffers& buffers,
                  cudaStream_t stream) {
  const std::uint32_t grid = 4 * multiprocessors(), capacity = lists.contacts.capacity;
  if (fits_one_kernel(capacity)) {
    launch_behind(place_by_rank, grid, kBlock, 0, stream, lists, buffers.sorted);
    return;
  }
  if (lists.upper_keys != nullptr) {
    sort_by_two_words(scene, lists, buffers, stream);
    return;
  }
  std::size_t space = buffers.space_bytes;
  if (const std::uint32_t bins = sort_bins(scene.key, capacity)) {
    LAZYCCD_CUDA_CHECK(cub::DeviceScan::ExclusiveSum(
        buffers.space, space, lists.bins, buffers.bin_starts, static_cast<int>(bins), stream));
    launch_behind(scatter_to_bins, grid, kBlock, 0, stream, lists, buffers.bin_starts,
                  scene.key.b_bits, buffers.sorted_keys, buffers.sorted_order);
  } else {
    LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(
        buffers.space, space, lists.keys, buffers.sorted_keys, buffers.order, buffers.sorted_order,
        static_cast<int>(capacity), scene.key.b_bits, scene.key.bits(), stream));
  }
  launch_behind(place_contacts, grid, kBlock, 0, stream, lists, buffers.sorted_keys,
                buffers.sorted_order, scene.key.b_bits, buffers.sorted);
}

}  // namespace lazyccd::gpu
