// Interface between Detector and its backends. Both backends use the same types for the mesh, the
// positions and the stats.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/narrow/contact_math.h"
#include "host/scene/mesh.h"
#include "lazyccd/contact.h"
#include "lazyccd/contact_columns.h"
#include "lazyccd/device.h"
#include "lazyccd/error.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"
#include "lazyccd/stats.h"

namespace lazyccd {

/// The GPU does not take this detection, though nothing has failed: the CPU must do it.
class NeedsCpu : public Error {
 public:
  explicit NeedsCpu(const std::string& what) : Error(ErrorCode::device, what) {}
};

/// A backend: the CPU or the GPU.
class BackendDetector {
 public:
  virtual ~BackendDetector() = default;
  /// Sets the mesh. It must stay valid until the next call of set_mesh().
  virtual void set_mesh(const Mesh& mesh) = 0;
  /// Returns the sorted contacts, valid until the next call. Fills the stats. Throws Error.
  virtual Span<const Contact> detect(const Positions& start, const Positions& end,
                                     Stats& stats) = 0;
};

/// A backend that also downloads fields of contacts alone, and detects from device memory to device
/// memory. Detections throw NeedsCpu for what it does not take, and can be called again after that.
class DeviceBackend : public BackendDetector {
 public:
  /// As detect(), for some fields. Valid until the next call.
  virtual ContactColumns detect_columns(const Positions& start, const Positions& end,
                                        std::uint32_t fields, Stats& stats) = 0;
  /// As Detector::detect_async().
  virtual DeviceContacts detect_async(const DevicePositions& start, const DevicePositions& end,
                                      CudaStream stream, const std::uint8_t* world_mask) = 0;
  /// As Detector::synchronize(). Fills the stats.
  virtual DeviceContacts synchronize(Stats& stats) = 0;
  /// Copies the contacts that synchronize() has completed to the host; none if it has not, since
  /// the last call of another function. Valid until the next call.
  virtual Span<const Contact> download() = 0;
  /// The pairs that the last detect() found within its separation, by ContactKind, in no particular
  /// order. Valid until the next call.
  virtual std::array<Span<const Candidate>, 2> near_pairs() = 0;
  /// By body: a lower bound of the distance of these pairs at the start of the step, or a large
  /// number. Valid until the next detection.
  virtual Span<const double> near_distances() = 0;
  /// Finds the edges of the next mesh and keeps them on the device; the mesh of before is lost
  /// there. Null: the host must find them.
  virtual TopologyFinder* topology_finder() = 0;
  /// Sets the mesh whose edges topology_finder() has just found.
  virtual void set_found_mesh(const Mesh& mesh) = 0;
};

}  // namespace lazyccd
