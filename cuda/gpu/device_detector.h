// The CUDA backend as a class: what detections from the host and in device memory share.
#pragma once

#include <cuda_runtime_api.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/bvh/front_policy.h"
#include "core/exact/stage_policy.h"
#include "gpu/completion.h"
#include "gpu/device/device_buffer.h"
#include "gpu/device/device_scope.h"
#include "gpu/device/stream.h"
#include "gpu/scene/active_bodies.h"
#include "gpu/scene/packed_positions.h"
#include "gpu/step.h"
#include "gpu/topology/topology_builder.h"
#include "host/backend.h"
#include "host/scene/column_copy.h"
#include "host/threads/thread_pool.h"

namespace lazyccd::gpu {

/// Runs detections on a stream, of its own or of the caller.
class DeviceDetector : public DeviceBackend, private TopologyFinder {
 public:
  DeviceDetector(const DetectorOptions& options, ThreadPool& threads);
  ~DeviceDetector() override { scope_.enter(); }

  void set_mesh(const Mesh& mesh) override;
  TopologyFinder* topology_finder() override;
  void set_found_mesh(const Mesh& mesh) override { take_mesh(mesh, true); }

  Span<const Contact> detect(const Positions& start, const Positions& end, Stats& stats) override;
  ContactColumns detect_columns(const Positions& start, const Positions& end, std::uint32_t fields,
                                Stats& stats) override;
  DeviceContacts detect_async(const DevicePositions& start, const DevicePositions& end,
                              CudaStream stream, const std::uint8_t* world_mask) override;
  DeviceContacts synchronize(Stats& stats) override;
  Span<const Contact> download() override;
  std::array<Span<const Candidate>, 2> near_pairs() override;
  Span<const double> near_distances() override;

 private:
  // Whether the counters of a step are on their way to the host, and of which step.
  struct Probe {
    Event done;
    bool under_way = false;
    bool front_reused = false;
    std::int64_t build = 0;  // number of the build that the step used
  };

  FoundTopology find(const TopologyInput& input) override;
  void take_mesh(const Mesh& mesh, bool is_found);
  // Throws NeedsCpu if the mesh has too many worlds and bodies for the sort.
  void check_key() const;
  // Waits until no step is under way.
  void settle();
  // Lets work on `stream` come behind the last step.
  void follow(cudaStream_t stream);
  StepInput input(bool from_front, ExactStage exact) const;
  // Builds the hierarchy on the device or on the host, from uploaded positions.
  void build_from_host(const Positions& start, const Positions& end);
  // Runs a step from positions on the host. Returns false if there is nothing to do.
  bool run_from_host(const Positions& start, const Positions& end, Stats& stats);
  // Notes that the hierarchy is built anew.
  void count_build();
  // Completes a step and takes in what it says. Throws as Completion::run() does.
  void complete(const StepInput& input, bool has_run, Stats& stats);
  // Takes in what a step says about the next ones.
  void learn(const StepCounters& counters);
  // Takes in the counters of an earlier step, if they have come. Makes the room that it lacked.
  void read_probe();
  // Forgets the last detect_async() and its result; for what works in the same memory.
  void forget_result();
  DeviceContacts result_on_device();
  // Copies contacts of the host to the device, as the result.
  void publish(Span<const Contact> contacts, std::uint64_t hash);

  DetectorOptions options_;
  int device_;
  DeviceScope scope_;  // while the members below begin and end
  std::string device_name_;
  Stream own_stream_;
  Event uploaded_[2];
  ThreadPool& pool_;

  const Mesh* mesh_ = nullptr;
  TopologyBuilder topology_;
  bool is_built_ = false;
  std::int64_t builds_ = 0;
  float built_area_ = 0;  // StepCounters::leaf_area of the first step after the build; 0: none yet
  PackedPositions positions_;
  HostPositions given_;  // of detect()
  ActiveBodies active_;
  Step step_;
  Completion completion_;
  FrontPolicy front_policy_;
  exact::StagePolicy exact_policy_;

  // The last detect_async().
  cudaStream_t stream_ = nullptr;  // of the last step
  Event last_done_;
  bool has_step_ = false;    // it was enqueued, and synchronize() has not completed it
  bool has_result_ = false;  // synchronize() has completed it
  bool has_work_ = false;    // work of another stream than own_stream_ may be under way
  bool had_front_ = false;
  StepInput last_input_{};
  Probe probe_;
  DeviceBuffer<DeviceStatus> status_;
  DeviceBuffer<Contact> published_;
  DeviceContacts result_;
  ColumnCopy columns_;            // of contacts that are not on the device
  Span<const Contact> gathered_;  // the result on the host; null if it is only on the device
};

}  // namespace lazyccd::gpu
