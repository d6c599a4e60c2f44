// The parts of a node, for the lanes that fit a volume to it: whole runs of the leaves below it,
// and the leaves at both ends. So no node waits for another.
#pragma once

#include "gpu/device/kernel_chain.cuh"
#include "gpu/scene/scene.cuh"

namespace lazyccd::gpu::research {

/// Calls run(i) and leaf(slot) for the lane's share of the leaves from range.x to range.y - 1.
template <int lanes, class Run, class Leaf>
__device__ inline void for_each_part(int2 range, int lane, Run&& run, Leaf&& leaf) {
  const int first_run = (range.x + kRun - 1) / kRun, last_run = range.y / kRun;
  const bool runs = first_run < last_run;
  const int before = runs ? first_run * kRun : range.y, after = runs ? last_run * kRun : range.y;
  for (int i = first_run + lane; i < last_run; i += lanes) run(i);
  for (int slot = range.x + lane; slot < before; slot += lanes) leaf(slot);
  for (int slot = after + lane; slot < range.y; slot += lanes) leaf(slot);
}

/// Calls f(names) for the lane's share of a group's faces, or of its edges if it has no face.
template <int lanes, class F>
__device__ inline void for_each_cell(const GroupView& view, std::int32_t g, int lane, F&& f) {
  const DeviceGroup group = load_wide(view.groups + g);
  const int skipped = group.count[kVertices] + (group.count[kFaces] != 0 ? group.count[kEdges] : 0);
  for (int i = skipped + lane; i < group.total(); i += lanes)
    f(load_wide(view.names + group.first_place + i));
}

}  // namespace lazyccd::gpu::research
