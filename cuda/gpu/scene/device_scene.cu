// Upload of the mesh, its groups and their hierarchy.
#include "gpu/scene/device_scene.h"

#include <algorithm>
#include <vector>

#include "cpu/scene/positions.h"
#include "gpu/device/upload.h"

namespace lazyccd::gpu {

void DeviceScene::set_mesh(const Mesh& mesh) {
  mesh_ = &mesh;
  mesh_uploaded_ = false;
}

void DeviceScene::upload_mesh() {
  upload(faces_, mesh_->faces().data(), mesh_->faces().size());
  upload(edges_, mesh_->edges().data(), mesh_->edges().size());
  upload(body_of_vertex_, mesh_->body_of_vertex().data(), mesh_->vertex_count());
  upload(bodies_, mesh_->bodies().data(), mesh_->body_count());
  std::vector<unsigned char> pinned(mesh_->any_pinned() ? mesh_->vertex_count() : 0);
  for (std::size_t v = 0; v < pinned.size(); ++v) pinned[v] = mesh_->pinned(static_cast<int>(v));
  upload(pinned_, pinned.data(), pinned.size());
  std::vector<std::uint64_t> disabled(mesh_->disabled_pairs().begin(),
                                      mesh_->disabled_pairs().end());
  std::sort(disabled.begin(), disabled.end());
  upload(disabled_, disabled.data(), disabled.size());
  upload(world_of_body_, mesh_->world_of_body().data(), mesh_->world_of_body().size());
  mesh_uploaded_ = true;
}

void DeviceScene::prepare() {
  if (!mesh_uploaded_) upload_mesh();
  const std::size_t groups = std::max<std::size_t>(group_count(), 1);
  device_groups_.reserve(groups);
  leaf_order_.reserve(groups);
  node_ranges_.reserve(2 * groups - 1);
  nodes_.reserve(2 * groups - 1);
  bounds_.reserve(groups);
  runs_.reserve(groups / kRun + 1);
  // Every primitive has one owner. A group's last block may have one used lane.
  const std::size_t primitives =
      mesh_->vertex_count() + mesh_->edges().size() + mesh_->faces().size();
  const std::size_t blocks = (primitives + (kBlockLanes - 1) * groups) / kBlockLanes + kReadBeyond;
  if (blocks <= blocks_.size()) return;
  blocks_.reserve(blocks);
  // The padding is read, though its values do not matter.
  LAZYCCD_CUDA_CHECK(cudaMemset(blocks_.data(), 0, blocks_.bytes()));
}

bool DeviceScene::reserve_records(bool is_double) {
  const std::size_t vertices = std::max<std::size_t>(mesh_->vertex_count(), 1);
  const std::size_t bytes = vertices * (is_double ? sizeof(DoubleRecord) : sizeof(FloatRecord));
  const std::size_t pieces = bytes / sizeof(RecordPiece);
  if (pieces <= records_.size()) return false;
  records_.reserve(pieces);
  return true;
}

HierarchyArrays DeviceScene::arrays() {
  return {device_groups_.data(), blocks_.data(), leaf_order_.data(), node_ranges_.data(),
          nodes_.data()};
}

void DeviceScene::build_on_host(const Positions& start, const Positions& end, ThreadPool& pool) {
  if (!mesh_uploaded_) upload_mesh();
  std::vector<VertexRecord> records;
  load_records(*mesh_, start, end, pool, records);
  groups_.build(*mesh_, records, pool);
  tree_.build(groups_.codes(), groups_.boxes(), pool, groups_.worlds());
  upload_groups();
  upload(nodes_, tree_.nodes().data(), tree_.nodes().size());
  upload(leaf_order_, tree_.order().data(), tree_.order().size());
  static_assert(sizeof(Tree::Range) == sizeof(int2));
  upload(node_ranges_, tree_.ranges().data(), tree_.ranges().size());
  bounds_.reserve(std::max<std::size_t>(groups_.groups().size(), 1));
  runs_.reserve(groups_.groups().size() / kRun + 1);
}

void DeviceScene::upload_groups() {
  std::vector<DeviceGroup> groups;
  std::vector<PrimitiveBlock> blocks;
  for (const Group& g : groups_.groups()) {
    DeviceGroup group{g.body,
                      static_cast<std::int32_t>(blocks.size()),
                      {},
                      g.pinned != 0,
                      mesh_->bodies()[static_cast<std::size_t>(g.body)].self_collision};
    int place = 0;
    for (int kind = 0; kind < 3; ++kind) {
      group.count[kind] = static_cast<std::uint8_t>(g.count[kind]);
      for (int i = 0; i < g.count[kind]; ++i, ++place) {
        const Block& block = groups_.blocks()[g.first[kind] + i / kBlockLanes];
        const int lane = i % kBlockLanes;
        if (place % kBlockLanes == 0) blocks.emplace_back();
        blocks.back().names[place % kBlockLanes] = {
            block.id[lane], {block.vertex[0][lane], block.vertex[1][lane], block.vertex[2][lane]}};
      }
    }
    groups.push_back(group);
  }
  blocks.resize(blocks.size() + kReadBeyond);
  upload(device_groups_, groups.data(), groups.size());
  upload(blocks_, blocks.data(), blocks.size());
}

SceneView DeviceScene::view(bool is_double) {
  SceneView s{};
  s.vertex_count = static_cast<std::uint32_t>(mesh_->vertex_count());
  s.group_count = group_count();
  s.node_count = node_count();
  s.groups = {device_groups_.data(), blocks_.data(),
              bounds_.data(),        bodies_.data(),
              disabled_.data(),      static_cast<std::uint32_t>(mesh_->disabled_pairs().size())};
  s.mesh = {reinterpret_cast<const std::int32_t(*)[3]>(faces_.data()),
            reinterpret_cast<const std::int32_t(*)[2]>(edges_.data()), body_of_vertex_.data()};
  s.pinned = mesh_->any_pinned() ? pinned_.data() : nullptr;
  s.leaf_order = leaf_order_.data();
  s.node_ranges = node_ranges_.data();
  s.key = key();
  if (s.key.world_of_body != nullptr) s.key.world_of_body = world_of_body_.data();
  s.separation = separation_;
  s.is_double = is_double;
  s.records = records_.data();
  s.runs = runs_.data();
  s.nodes = nodes_.data();
  return s;
}

ContactKey DeviceScene::key() const { return mesh_->contact_key(); }

std::size_t DeviceScene::bytes() const {
  return faces_.bytes() + edges_.bytes() + body_of_vertex_.bytes() + pinned_.bytes() +
         bodies_.bytes() + disabled_.bytes() + world_of_body_.bytes() + device_groups_.bytes() +
         leaf_order_.bytes() + node_ranges_.bytes() + records_.bytes() + blocks_.bytes() +
         bounds_.bytes() + runs_.bytes() + nodes_.bytes();
}

}  // namespace lazyccd::gpu
