// The culling data of a scene: allocation, upload and launches.
#include "research/gpu_culling/device_culling.h"

#include <algorithm>
#include <vector>

#include "gpu/device/upload.h"
#include "gpu/narrow/leaf.cuh"
#include "host/extension.h"
#include "research/culling/flat_patches.h"
#include "research/culling/orphan_sets.h"
#include "research/gpu_culling/node_diagonals.cuh"
#include "research/gpu_culling/normal_cones.cuh"
#include "research/gpu_culling/oriented_boxes.cuh"
#include "research/gpu_culling/orphans.cuh"

namespace lazyccd::gpu::research {

DeviceCulling::DeviceCulling(const DetectorOptions& options)
    : volume_(options.algorithm.volume), culling_(culling_in_use(options)) {
  host_counters_.reserve(1);
  *host_counters_.data() = {};
  counters_.reserve(1);
}

void DeviceCulling::set_mesh(const Mesh& mesh) {
  if (!culling_.orphan_sets) return;
  const OrphanSets sets(mesh);
  for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
    const OrphanList list = sets.of(kind);
    Orphans& orphans = orphans_[static_cast<int>(kind)];
    orphans.count = list.count;
    upload(orphans.pairs, list.pairs, list.count);
    const std::size_t primitives =
        kind == ContactKind::vertex_face ? mesh.vertex_count() : mesh.edge_count();
    upload(orphans.first, list.first, primitives + 1);
  }
}

void DeviceCulling::reserve(std::size_t leaves, std::size_t nodes) {
  const std::size_t runs = (leaves + kRun - 1) / kRun;
  if (volume_ == Volume::oriented_box) {
    first_run_ = static_cast<std::uint32_t>(leaves);
    first_node_ = first_run_ + static_cast<std::uint32_t>(runs);
    boxes_.reserve(first_node_ + nodes);
    moments_.reserve(first_node_ + nodes);
    node_boxes_.reserve(nodes);
  }
  if (volume_ == Volume::dop18) {
    run_diagonals_.reserve(runs);
    node_diagonals_.reserve(nodes);
  }
}

void DeviceCulling::set_tree(const Mesh& mesh, const Groups& groups, const Tree& tree) {
  Patches of_tree;
  of_tree.build(mesh, groups, tree);
  std::vector<NodePatch> patches;
  for (std::uint32_t node = 0; node < of_tree.boundaries().size(); ++node) {
    const Patches::Boundary boundary = of_tree.boundaries()[node];
    if (boundary.count != 0) patches.push_back({node, boundary.first, boundary.count});
  }
  // The longest boundaries come first, so that none of them begins last.
  std::stable_sort(patches.begin(), patches.end(),
                   [](const NodePatch& x, const NodePatch& y) { return x.count > y.count; });
  patch_count_ = static_cast<std::uint32_t>(patches.size());
  upload(patches_, patches.data(), patches.size());
  upload(boundary_vertices_, of_tree.vertices().data(), of_tree.vertices().size());
  leaf_cones_.reserve(tree.order().size());
  const std::vector<unsigned char> none(tree.nodes().size(), 0);
  upload(flat_, none.data(), none.size());
}

void DeviceCulling::clear_counters(cudaStream_t stream) {
  LAZYCCD_CUDA_CHECK(cudaMemsetAsync(counters_.data(), 0, sizeof(CullingCounters), stream));
}

void DeviceCulling::clear_leaf_counters(cudaStream_t stream) {
  LAZYCCD_CUDA_CHECK(
      cudaMemsetAsync(&counters_.data()->orphans, 0, sizeof(CullingCounters::orphans), stream));
}

constexpr std::uint32_t kBlock = 128;  // threads of a block, if a warp has a leaf or a node

template <class Record>
void DeviceCulling::enqueue_cones(const SceneView& scene, cudaStream_t stream) {
  if (patch_count_ == 0) return;
  const NormalConesView view{patches_.data(), boundary_vertices_.data(), leaf_cones_.data(),
                             flat_.data()};
  launch_behind(find_cones<Record>, blocks_for(std::size_t{scene.group_count} * kWarp, kBlock),
                kBlock, 0, stream, scene, view);
  launch_behind(find_flat_nodes<Record>, patch_count_, kLoopBlock, 0, stream, scene, view);
}

template <class Record>
void DeviceCulling::enqueue_boxes(const SceneView& scene, cudaStream_t stream) {
  const OrientedBoxesView view{boxes_.data(), moments_.data(), node_boxes_.data(),
                               first_run_,    first_node_,     first_node_ + scene.node_count};
  const std::uint32_t runs = first_node_ - first_run_;
  const std::uint32_t nodes = blocks_for(std::size_t{scene.node_count} * kFitLanes, kFitBlock);
  launch_behind(sum_leaves<Record>, runs, kFitBlock, 0, stream, scene, view);
  launch_behind(sum_nodes, nodes, kFitBlock, 0, stream, scene, view);
  launch_behind(find_axes, blocks_for(view.count, 64), 64, 0, stream, view);
  launch_behind(fit_leaves<Record>, runs, kFitBlock, 0, stream, scene, view);
  launch_behind(fit_nodes, nodes, kFitBlock, 0, stream, scene, view);
}

void DeviceCulling::enqueue_diagonals(const SceneView& scene, cudaStream_t stream) {
  launch_behind(unite_runs, blocks_for(std::size_t{scene.group_count} * kWarp / kRun, kBlock),
                kBlock, 0, stream, scene, run_diagonals_.data());
  launch_behind(unite_nodes, blocks_for(std::size_t{scene.node_count} * kWarp, kBlock), kBlock, 0,
                stream, scene, run_diagonals_.data(), node_diagonals_.data());
}

template <class Record>
void DeviceCulling::enqueue_refit_as(const SceneView& scene, cudaStream_t stream) {
  if (volume_ == Volume::oriented_box) enqueue_boxes<Record>(scene, stream);
  if (volume_ == Volume::dop18) enqueue_diagonals(scene, stream);
  if (culling_.normal_cones) enqueue_cones<Record>(scene, stream);
}

void DeviceCulling::enqueue_refit(const SceneView& scene, cudaStream_t stream) {
  if (scene.is_double) {
    enqueue_refit_as<DoubleRecord>(scene, stream);
  } else {
    enqueue_refit_as<FloatRecord>(scene, stream);
  }
}

// The orphans do not depend on the pairs of groups: the kernel behind the first of them tests all.
bool DeviceCulling::enqueue_leaf(const SceneView& scene, const LeafPairs& pairs, bool vertex_face,
                                 bool edge_edge, const StepLists& lists, cudaStream_t stream) {
  if (!culling_.orphan_sets) return false;
  enqueue_leaf_kernel(scene, pairs, vertex_face, edge_edge, filter(), lists, stream);
  if (pairs.first != 0) return true;
  const std::uint32_t max_orphans = std::max(orphans_[0].count, orphans_[1].count);
  launch_behind(scene.is_double ? filter_orphans<DoubleRecord> : filter_orphans<FloatRecord>,
                blocks_for(max_orphans, kBlock), kBlock, 0, stream, scene, filter(), vertex_face,
                edge_edge, lists, counters_.data());
  return true;
}

const NodeCulling* DeviceCulling::of_nodes() {
  if (volume_ == Volume::box && !culling_.normal_cones) return nullptr;
  of_nodes_ = {volume_ == Volume::oriented_box ? node_boxes_.data() : nullptr,
               volume_ == Volume::dop18 ? node_diagonals_.data() : nullptr,
               culling_.normal_cones ? flat_.data() : nullptr, counters_.data()};
  return &of_nodes_;
}

OrphanFilter DeviceCulling::filter() const {
  OrphanFilter view{culling_.non_penetration, {}};
  for (int kind = 0; kind < 2; ++kind)
    view.orphans[kind] = {orphans_[kind].pairs.data(), orphans_[kind].first.data(),
                          orphans_[kind].count};
  return view;
}

void DeviceCulling::download(cudaStream_t stream) {
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(host_counters_.data(), counters_.data(),
                                     sizeof(CullingCounters), cudaMemcpyDeviceToHost, stream));
}

void DeviceCulling::add_to(Stats& stats) const {
  const CullingCounters& culled = *host_counters_.data();
  stats.culled_by_volume = static_cast<std::int64_t>(culled.culled_by_volume);
  stats.culled_by_normal_cone = static_cast<std::int64_t>(culled.culled_by_normal_cone);
  stats.orphan_tests = culled.orphans;
}

std::size_t DeviceCulling::bytes() const {
  std::size_t sum = counters_.bytes() + boxes_.bytes() + node_boxes_.bytes() + moments_.bytes() +
                    run_diagonals_.bytes() + node_diagonals_.bytes() + patches_.bytes() +
                    boundary_vertices_.bytes() + leaf_cones_.bytes() + flat_.bytes();
  for (const Orphans& orphans : orphans_) sum += orphans.pairs.bytes() + orphans.first.bytes();
  return sum;
}

}  // namespace lazyccd::gpu::research
