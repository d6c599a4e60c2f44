// The lists that a step fills on the device, and their copies on the host.
#pragma once

#include <cuda_runtime_api.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "gpu/device/device_buffer.h"
#include "gpu/device/pinned_buffer.h"
#include "gpu/scene/stages.h"
#include "lazyccd/contact_columns.h"

namespace lazyccd::gpu {

/// Most items of a list: its sort counts them in 31 bits.
constexpr std::uint32_t kMostItems = 0x7fffffffu;

/// A list in device memory. If a step overflows it, its capacity grows to what that step would have
/// needed and a quarter more.
template <class T>
class StepList {
 public:
  explicit StepList(std::uint32_t capacity) : capacity_(capacity) {}

  std::uint32_t capacity() const { return capacity_; }
  void set_capacity(std::uint32_t capacity) { capacity_ = capacity; }
  /// Returns whether `count` items did not fit. If so, and if `grows`, they fit after the next
  /// reserve(), unless they are more than kMostItems.
  bool outgrown(std::uint32_t count, bool grows) {
    if (count <= capacity_) return false;
    if (!grows) return true;
    const std::uint64_t wanted = std::uint64_t{count} + count / 4;
    capacity_ = static_cast<std::uint32_t>(std::min(wanted, std::uint64_t{kMostItems}));
    return true;
  }

  void reserve() { items_.reserve(capacity_); }
  /// Frees the memory and halves the capacity, down to `least`.
  bool shrink(std::uint32_t least) {
    items_.free();
    if (capacity_ <= least) return false;
    capacity_ = std::max(capacity_ / 2, least);
    return true;
  }
  T* data() { return items_.data(); }
  Output<T> output(std::uint32_t* count) { return {items_.data(), capacity_, count}; }
  std::size_t bytes() const { return items_.bytes(); }

 private:
  std::uint32_t capacity_;
  DeviceBuffer<T> items_;
};

/// The counters and lists of a step, on the device and on the host.
class StepBuffers {
 public:
  /// capacity_hint: first capacity of every list; 0: the default of each list. lists_near: steps
  /// have a separation.
  StepBuffers(std::uint32_t capacity_hint, bool lists_near);

  /// Allocates the lists that have grown. `key` is that of the mesh.
  void reserve(const ContactKey& key, cudaStream_t stream);
  StepLists lists();
  SortBuffers sort_buffers();

  /// Enqueues the download of the counters and of as many contacts as the last step makes likely:
  /// whole contacts, or, after want_columns(), some of their fields.
  void download(cudaStream_t stream);
  void want_columns(std::uint32_t fields) { column_fields_ = fields; }  ///< 0: whole contacts
  void download_counters(cudaStream_t stream);
  const StepCounters& counters() const { return *host_counters_.data(); }
  /// Returns how many lists were too short, judged by the counters. If `grows`, they are longer
  /// after the next reserve().
  int grow(bool grows);
  /// Frees the lists and halves their capacities, for the next reserve(). Returns false if they are
  /// short already.
  bool shrink();
  /// Downloads the rest of the contacts and returns all of them, in order. The array has room for
  /// one more contact per query of download_too_wide().
  Contact* finish_contacts();
  /// The same for fields.
  ContactColumns finish_columns(cudaStream_t stream);
  const Contact* sorted() const { return sorted_.data(); }  ///< on the device
  std::uint32_t contact_capacity() const { return contacts_.capacity(); }
  /// Downloads the pairs of a kind within the separation.
  Span<const Candidate> download_near(ContactKind kind);
  /// Downloads the queries that need integers of any size: counters().too_wide of them.
  const HardQuery* download_too_wide();

  std::size_t bytes() const;

 private:
  template <class Body>
  void for_each_list(Body&& body);
  void expect_contacts();
  void download_columns(std::uint32_t count, cudaStream_t stream);

  DeviceBuffer<StepCounters> counters_;
  StepList<Candidate> filtered_[2]{StepList<Candidate>(1 << 16), StepList<Candidate>(1 << 18)};
  StepList<Survivor> hits_[2]{StepList<Survivor>(1 << 14), StepList<Survivor>(1 << 16)};
  StepList<Candidate> undecided_in_single_[2]{StepList<Candidate>(1 << 13),
                                              StepList<Candidate>(1 << 15)};
  bool lists_near_;
  StepList<Candidate> near_[2]{StepList<Candidate>(1 << 12), StepList<Candidate>(1 << 14)};
  StepList<HardQuery> hard_{1 << 12}, undecided_in_double_{1 << 10}, too_wide_{1 << 6};
  StepList<Contact> contacts_{1 << 11};
  DeviceBuffer<Contact> sorted_;
  DeviceBuffer<std::uint64_t> keys_, upper_keys_, sorted_keys_;
  DeviceBuffer<std::uint32_t> order_, sorted_order_, final_order_, bins_, bin_starts_, ranks_;
  DeviceBuffer<char> sort_space_;
  PinnedBuffer<StepCounters> host_counters_;
  PinnedBuffer<Contact> host_contacts_;
  PinnedBuffer<HardQuery> host_too_wide_;
  PinnedBuffer<Candidate> host_near_[2];
  DeviceBuffer<char> columns_;
  PinnedBuffer<char> host_columns_;
  std::uint32_t column_fields_ = 0, downloaded_columns_ = 0;
  std::uint32_t expected_contacts_ = 1024, downloaded_ = 0;
  std::uint32_t bin_count_ = 0;
  bool two_words_ = false;  // whether the keys are
};

}  // namespace lazyccd::gpu
