// Finding of the edges and the cells of a mesh on the device: what EdgeTable and Cells find on the
// host, to the bit.
#pragma once

#include <cuda_runtime_api.h>

#include <cstdint>
#include <vector>

#include "gpu/device/pinned_buffer.h"
#include "gpu/device/staged_upload.h"
#include "gpu/scene/device_scene.h"
#include "host/scene/topology_finder.h"
#include "host/threads/thread_pool.h"

namespace lazyccd::gpu {

struct TopologyReport;
struct SideView;

/// Works in the scene's workspace.
class TopologyBuilder {
 public:
  TopologyBuilder();
  ~TopologyBuilder();
  TopologyBuilder(const TopologyBuilder&) = delete;
  TopologyBuilder& operator=(const TopologyBuilder&) = delete;

  /// Uploads the faces and fills DeviceMesh, all but its tables. Waits for the device. No step may
  /// be under way.
  FoundTopology build(const TopologyInput& input, DeviceScene& scene, ThreadPool& pool,
                      cudaStream_t stream);

 private:
  struct Arrays;
  void upload_input(const TopologyInput& input, DeviceMesh& mesh, const Arrays& arrays,
                    ThreadPool& pool, cudaStream_t stream);
  void sort_sides(const SideView& view, Arrays& arrays, cudaStream_t stream);
  void sum_marks(const SideView& view, const Arrays& arrays, cudaStream_t stream);
  void read_report(const Arrays& arrays, cudaStream_t stream);
  void sort_cells(Arrays& arrays, cudaStream_t stream);
  // Reads where the segments begin, and returns them.
  std::vector<CellSegment> read_segments(const Arrays& arrays, cudaStream_t stream);

  StagedUpload upload_;
  PinnedBuffer<TopologyReport> report_;
  PinnedBuffer<std::uint32_t> starts_;
  std::vector<std::int32_t> bodies_;  // in the order of their worlds
  std::vector<std::int32_t> ranks_;   // by body, its place there; empty: its index
  std::uint32_t cell_count_ = 0;
};

}  // namespace lazyccd::gpu
