// Detection from device memory to device memory, for callers that live on the GPU. Plain C++: it
// needs no header of CUDA.
//
//   const DeviceContacts found = detector.detect_async(start, end, stream);
//   my_kernel<<<blocks, threads, 0, stream>>>(found.contacts, found.status);
//   detector.synchronize();  // now and then: waits, and completes a list that was too short
#pragma once

#include <cstddef>
#include <cstdint>

#include "lazyccd/contact.h"

struct CUstream_st;

namespace lazyccd {

using CudaStream = CUstream_st*;  ///< the same type as cudaStream_t; null: the default stream

/// View of the positions of all vertices in device memory, as Positions is of host memory: three
/// consecutive floats or doubles per vertex. It does not own the memory.
class DevicePositions {
 public:
  /// `count` vertices; `stride` is the distance in bytes from one vertex to the next.
  DevicePositions(const float* xyz, std::size_t count, std::size_t stride = 3 * sizeof(float))
      : data_(xyz), count_(count), stride_(stride), is_double_(false) {}
  DevicePositions(const double* xyz, std::size_t count, std::size_t stride = 3 * sizeof(double))
      : data_(xyz), count_(count), stride_(stride), is_double_(true) {}

  std::size_t count() const { return count_; }    ///< number of vertices
  std::size_t stride() const { return stride_; }  ///< bytes
  bool is_double() const { return is_double_; }
  const void* data() const { return data_; }

 private:
  const void* data_;
  std::size_t count_;
  std::size_t stride_;
  bool is_double_;
};

/// What DeviceStatus::incomplete is made of.
enum Incomplete : std::uint32_t {
  kNotFinite = 1,  ///< a position is not finite
  kTooLarge = 2,   ///< a position is beyond 2^100, which only the CPU takes
  kOverflow = 4,   ///< a list was too short
  kTooWide = 8,    ///< a query needs integers of more than 1024 bits, which only the CPU has
};

/// What the device knows of a detection.
struct DeviceStatus {
  std::uint64_t hash;        ///< contact_hash() of the contacts, if they are complete
  std::uint32_t count;       ///< number of contacts in DeviceContacts::contacts
  std::uint32_t incomplete;  ///< bits of Incomplete; 0: these are all contacts
};

/// The contacts of a detection in device memory, sorted as Detector::detect() sorts them.
struct DeviceContacts {
  const Contact* contacts = nullptr;     ///< device memory: status->count contacts
  const DeviceStatus* status = nullptr;  ///< device memory
  std::size_t capacity = 0;              ///< room for so many contacts; never less than the count
  int device = 0;                        ///< index of the GPU that has the memory
};

}  // namespace lazyccd
