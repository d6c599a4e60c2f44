// Kernels that bring the contacts into order.
#pragma once

#include "core/narrow/column_layout.h"
#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/scene.cuh"

namespace lazyccd::gpu {

/// Writes the lower words of the keys again, after sort_by_two_words() has overwritten them.
__global__ void write_lower_keys(SceneView scene, StepLists lists) {
  begin_kernel();
  const std::uint32_t count = min(*lists.contacts.count, lists.contacts.capacity);
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < lists.contacts.capacity;
       i += gridDim.x * blockDim.x)
    lists.keys[i] = i < count ? scene.key(lists.contacts.items[i]) : ~std::uint64_t{0};
}

/// Copies one quarter of a contact, 16 bytes.
__device__ inline void copy_contact(const Contact* from, Contact* to, int quarter) {
  static_assert(sizeof(Contact) == 4 * sizeof(int4));
  reinterpret_cast<int4*>(to)[quarter] = reinterpret_cast<const int4*>(from)[quarter];
}

/// Returns how many contacts the list holds.
__device__ inline std::uint32_t stored_contacts(const StepLists& lists) {
  return min(*lists.contacts.count, lists.contacts.capacity);
}

/// Tells the caller on the device what the step found, by the first thread of the last kernel.
__device__ inline void report_status(const StepLists& lists) {
  const StatusReport& report = lists.report;
  if (report.status == nullptr || blockIdx.x != 0 || threadIdx.x != 0) return;
  const StepCounters& c = *lists.counters;
  bool overflow = report.traversal->leaf_pairs > report.leaf_pairs || report.traversal->lost != 0 ||
                  report.traversal->front_nodes > report.front_nodes ||
                  c.hard > lists.hard.capacity ||
                  c.undecided_in_double > lists.undecided_in_double.capacity ||
                  c.too_wide > lists.too_wide.capacity || c.contacts > lists.contacts.capacity;
  for (int kind = 0; kind < 2; ++kind)
    overflow = overflow || c.candidates[kind] >> 32 != 0 ||
               c.filtered[kind] > lists.filtered[kind].capacity ||
               c.hits[kind] > lists.hits[kind].capacity ||
               c.undecided_in_single[kind] > lists.undecided_in_single[kind].capacity;
  report.status->hash = c.hash;
  report.status->count = stored_contacts(lists);
  report.status->incomplete = (c.bad_positions & 1 ? kNotFinite : 0) |
                              (c.bad_positions & 2 ? kTooLarge : 0) | (overflow ? kOverflow : 0) |
                              (c.too_wide != 0 ? kTooWide : 0);
}

/// Writes each contact to its final place. `keys` and `order` are sorted by the key's bits from
/// first_bit on. Few contacts agree in these bits; they find their rank by counting.
__global__ void place_contacts(StepLists lists, const std::uint64_t* keys,
                               const std::uint32_t* order, int first_bit, Contact* sorted) {
  begin_kernel();
  report_status(lists);
  const std::uint32_t count = stored_contacts(lists);
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < count;
       i += gridDim.x * blockDim.x) {
    const std::uint64_t key = keys[i];
    std::uint32_t place = i;
    for (std::uint32_t j = i; j-- > 0 && keys[j] >> first_bit == key >> first_bit;)
      place -= keys[j] > key;
    for (std::uint32_t j = i + 1; j < count && keys[j] >> first_bit == key >> first_bit; ++j)
      place += keys[j] < key;
    for (int k = 0; k < 4; ++k) copy_contact(lists.contacts.items + order[i], sorted + place, k);
  }
}

/// Collects the upper words of the keys in an order, of all places.
__global__ void gather_upper_keys(const std::uint64_t* upper, const std::uint32_t* order,
                                  std::uint32_t count, std::uint64_t* gathered) {
  begin_kernel();
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < count;
       i += gridDim.x * blockDim.x)
    gathered[i] = upper[order[i]];
}

/// Writes each contact to its final place, which `order` gives.
__global__ void place_in_order(StepLists lists, const std::uint32_t* order, Contact* sorted) {
  begin_kernel();
  report_status(lists);
  const std::uint64_t count = std::uint64_t{4} * stored_contacts(lists);
  for (std::uint64_t i = blockIdx.x * blockDim.x + threadIdx.x; i < count;
       i += gridDim.x * blockDim.x)
    copy_contact(lists.contacts.items + order[i / 4], sorted + i / 4, static_cast<int>(i % 4));
}

/// Moves keys and indices into their bins, in any order within a bin.
__global__ void scatter_to_bins(StepLists lists, const std::uint32_t* bin_starts, int first_bit,
                                std::uint64_t* sorted_keys, std::uint32_t* sorted_order) {
  begin_kernel();
  const std::uint32_t count = stored_contacts(lists);
  for (std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x; i < count;
       i += gridDim.x * blockDim.x) {
    const std::uint64_t key = lists.keys[i];
    const std::uint32_t place = bin_starts[key >> first_bit] + lists.ranks[i];
    sorted_keys[place] = key;
    sorted_order[place] = i;
  }
}

/// Sorts few contacts: one warp per contact finds its rank by counting smaller keys.
__global__ void place_by_rank(StepLists lists, Contact* sorted) {
  begin_kernel();
  report_status(lists);
  const std::uint32_t count = stored_contacts(lists);
  const int lane = threadIdx.x % kWarp;
  const std::uint32_t warps = gridDim.x * blockDim.x / kWarp;
  for (std::uint32_t i = (blockIdx.x * blockDim.x + threadIdx.x) / kWarp; i < count; i += warps) {
    const std::uint64_t key = lists.keys[i];
    unsigned rank = 0;
    if (lists.upper_keys == nullptr) {
      for (std::uint32_t j = lane; j < count; j += kWarp) rank += lists.keys[j] < key;
    } else {
      const std::uint64_t upper = lists.upper_keys[i];
      for (std::uint32_t j = lane; j < count; j += kWarp)
        rank +=
            lists.upper_keys[j] < upper || (lists.upper_keys[j] == upper && lists.keys[j] < key);
    }
    for (int offset = kWarp / 2; offset > 0; offset /= 2)
      rank += __shfl_xor_sync(kAllLanes, rank, offset);
    if (lane < 4) copy_contact(lists.contacts.items + i, sorted + rank, lane);
  }
}

/// Copies the fields of contacts to arrays of their own, one thread per contact. `capacity`: of
/// `sorted`; the count is larger if the list has overflowed.
__global__ void split_contacts(const Contact* sorted, std::uint32_t capacity,
                               const std::uint32_t* count, ColumnLayout layout, char* block) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < *count && i < capacity && i < layout.places) layout.put(sorted[i], i, block);
}

/// Fills `order` with 0, 1, ..., count - 1.
__global__ void number_places(std::uint32_t* order, std::uint32_t count) {
  const std::uint32_t i = blockIdx.x * blockDim.x + threadIdx.x;
  if (i < count) order[i] = i;
}

}  // namespace lazyccd::gpu
