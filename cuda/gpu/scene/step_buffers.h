// The lists that a step fills, on the device, and what comes back to the host.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <cstdint>

#include "gpu/device/device_buffer.h"
#include "gpu/device/pinned_buffer.h"
#include "gpu/stages.h"

namespace lazyccd::gpu {

// A list on the device that grows to what a step would have needed.
template <class T>
class StepList {
 public:
  explicit StepList(std::uint32_t capacity) : capacity_(capacity) {}

  std::uint32_t capacity() const { return capacity_; }
  void set_capacity(std::uint32_t capacity) { capacity_ = capacity; }
  // Whether so many did not fit; then more do from the next reserve() on.
  bool outgrown(std::uint32_t count) {
    if (count <= capacity_) return false;
    capacity_ = count + count / 4;
    return true;
  }

  void reserve() { items_.reserve(capacity_); }
  T* data() { return items_.data(); }
  Output<T> output(std::uint32_t* count) { return {items_.data(), capacity_, count}; }
  std::size_t bytes() const { return items_.bytes(); }

 private:
  std::uint32_t capacity_;
  DeviceBuffer<T> items_;
};

class StepBuffers {
 public:
  explicit StepBuffers(std::uint32_t capacity_hint);  // of every list at first; 0: the default

  // Allocates what has grown. The key is that of the mesh.
  void reserve(const ContactKey& key, cudaStream_t stream);
  StepLists lists();
  SortBuffers sort_buffers();

  // Enqueues the download of the counters and of as many contacts as the last step makes likely.
  void download(cudaStream_t stream);
  const StepCounters& counters() const { return *host_counters_.data(); }
  // By the counters: how many lists were too short; they are longer for the next try.
  int grow();
  // The rest of the contacts, in order, with room for as many more as there are in the residue.
  Contact* finish_contacts();
  // The queries that double could not decide; counters().residue of them.
  const HardQuery* download_residue();

  std::size_t bytes() const;

 private:
  DeviceBuffer<StepCounters> counters_;
  StepList<Candidate> filtered_[2]{StepList<Candidate>(1 << 16), StepList<Candidate>(1 << 18)};
  StepList<Survivor> hits_[2]{StepList<Survivor>(1 << 14), StepList<Survivor>(1 << 16)};
  StepList<Candidate> undecided_[2]{StepList<Candidate>(1 << 13), StepList<Candidate>(1 << 15)};
  StepList<HardQuery> hard_{1 << 12}, residue_{1 << 10};
  StepList<Contact> contacts_{1 << 11};
  DeviceBuffer<Contact> sorted_;
  DeviceBuffer<std::uint64_t> keys_, sorted_keys_;
  DeviceBuffer<std::uint32_t> order_, sorted_order_, bins_, bin_starts_, ranks_;
  DeviceBuffer<char> sort_space_;
  PinnedBuffer<StepCounters> host_counters_;
  PinnedBuffer<Contact> host_contacts_;
  PinnedBuffer<HardQuery> host_residue_;
  std::uint32_t expected_contacts_ = 1024, downloaded_ = 0;
  std::uint32_t bin_count_ = 0;
};

}  // namespace lazyccd::gpu
