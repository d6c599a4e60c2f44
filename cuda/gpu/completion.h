// Completion of a step: what did not fit runs again, in parts if memory is short, and the host
// decides what the device cannot.
#pragma once

#include <cuda_runtime_api.h>

#include <utility>
#include <vector>

#include "gpu/scene/packed_positions.h"
#include "gpu/step.h"
#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/detector.h"

namespace lazyccd::gpu {

/// Positions on the host, from which the host decides. Null: those on the device are copied.
struct HostPositions {
  const Positions *start = nullptr, *end = nullptr;
};

/// Runs steps to their end. Waits for the device.
class Completion {
 public:
  Completion(const DetectorOptions& options, Step& step, PackedPositions& positions,
             ThreadPool& threads)
      : options_(options), step_(step), positions_(positions), pool_(threads) {}

  void set_mesh(const Mesh& mesh) { mesh_ = &mesh; }
  /// Runs a step, or, if `has_run`, what is left of it. Counts overflows and parts in the stats.
  /// Throws if the step met positions that it cannot take: NeedsCpu if the CPU can.
  void run(StepInput input, bool has_run, const HostPositions& given, cudaStream_t stream,
           Stats& stats);
  /// The counters of the step, of all its parts.
  const StepCounters& counters() const { return counters_; }
  /// Whether all contacts lie sorted on the device.
  bool is_on_device() const { return !in_parts_ && counters_.too_wide == 0; }
  /// Returns the contacts of the step on the host, with those that only the host can decide. Adds
  /// the latter to the stats. Valid until the next step.
  Span<const Contact> contacts(const HostPositions& given, Stats& stats);
  /// Returns the pairs of the step within its separation, in no particular order. Valid until the
  /// next step or call.
  Span<const Candidate> near_pairs(ContactKind kind);

 private:
  // Returns whether memory was too short, so that the pairs must be taken in parts.
  bool run_whole(StepInput& input, bool has_run, const HostPositions& given, cudaStream_t stream,
                 Stats& stats);
  void run_in_parts(const StepInput& input, cudaStream_t stream, Stats& stats);
  void check_positions(const StepCounters& counters, const HostPositions& given);
  std::pair<Positions, Positions> host_positions(const HostPositions& given);

  const DetectorOptions& options_;
  Step& step_;
  PackedPositions& positions_;
  ThreadPool& pool_;
  const Mesh* mesh_ = nullptr;
  StepCounters counters_{};
  // A step in parts: its contacts, with room for those of its wide queries.
  bool in_parts_ = false;
  std::vector<Contact> part_contacts_;
  std::vector<HardQuery> part_queries_;
  std::vector<Candidate> part_near_[2];
};

}  // namespace lazyccd::gpu
