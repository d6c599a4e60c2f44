// Memory for the groups and their hierarchy, and their upload.
#include "gpu/scene/device_scene.h"

#include <algorithm>
#include <vector>

#include "gpu/device/upload.h"
#include "host/scene/positions.h"

namespace lazyccd::gpu {

void DeviceScene::set_mesh(const Mesh& mesh, bool is_found) {
  mesh_ = &mesh;
  is_found_ = is_found;
  mesh_uploaded_ = false;
}

void DeviceScene::upload_mesh() {
  if (!is_found_) arrays_.upload_primitives(*mesh_);
  arrays_.upload_tables(*mesh_, separation_ > 0);
  if (separation_ > 0) {
    uploaded_resting_.assign(mesh_->body_count(), 0);
    upload(resting_, uploaded_resting_.data(), uploaded_resting_.size());
    near_distances_.reserve(mesh_->body_count());
    host_near_distances_.reserve(mesh_->body_count());
  }
  mesh_uploaded_ = true;
}

void DeviceScene::update_resting(cudaStream_t stream) {
  const auto is_as_uploaded = [this] {
    if (mesh_->any_resting()) return mesh_->has_resting(uploaded_resting_);
    return std::find(uploaded_resting_.begin(), uploaded_resting_.end(), 1) ==
           uploaded_resting_.end();
  };
  if (is_as_uploaded()) return;
  uploaded_resting_.assign(mesh_->resting().begin(), mesh_->resting().end());
  uploaded_resting_.resize(mesh_->body_count(), 0);
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(resting_.data(), uploaded_resting_.data(),
                                     uploaded_resting_.size(), cudaMemcpyHostToDevice, stream));
}

void DeviceScene::clear_near_distances(cudaStream_t stream) {
  constexpr int large = 0x7f;  // doubles of these bytes are about 1e306
  LAZYCCD_CUDA_CHECK(
      cudaMemsetAsync(near_distances_.data(), large, mesh_->body_count() * sizeof(double), stream));
}

void DeviceScene::download_near_distances(cudaStream_t stream) {
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(host_near_distances_.data(), near_distances_.data(),
                                     mesh_->body_count() * sizeof(double), cudaMemcpyDeviceToHost,
                                     stream));
}

Span<const double> DeviceScene::near_distances() const {
  return {host_near_distances_.data(), mesh_->body_count()};
}

char* DeviceScene::workspace(std::size_t bytes) {
  reserve_boxes(bytes);
  return reinterpret_cast<char*>(boxes_.data());
}

void DeviceScene::reserve_boxes(std::size_t bytes) {
  const std::size_t pieces = (bytes + sizeof(RecordPiece) - 1) / sizeof(RecordPiece);
  if (pieces <= boxes_.size()) return;
  boxes_.reserve(pieces);
  // The padding is read, though its values do not matter.
  LAZYCCD_CUDA_CHECK(cudaMemset(boxes_.data(), 0, boxes_.bytes()));
  // The memory is used on other streams, which do not wait for this one.
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(cudaStreamLegacy));
}

void DeviceScene::reserve_places(std::size_t places) {
  places_ = places + kReadBeyond;
  reserve_boxes(places_ * BoxArrays::kBytes);
  names_.reserve(places);
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
  // Every primitive has one owner. The last places of a group may be unused.
  const std::size_t primitives =
      mesh_->vertex_count() + mesh_->edge_count() + mesh_->faces().size();
  reserve_places(primitives + (kPlaceUnit - 1) * groups);
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
  return {device_groups_.data(), names_.data(), leaf_order_.data(), node_ranges_.data(),
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
  std::vector<PrimitiveNames> names;
  for (const Group& g : groups_.groups()) {
    DeviceGroup group{g.body,
                      static_cast<std::int32_t>(names.size()),
                      {},
                      g.pinned != 0,
                      mesh_->bodies()[static_cast<std::size_t>(g.body)].self_collision};
    for (int kind = 0; kind < 3; ++kind) {
      group.count[kind] = static_cast<std::uint8_t>(g.count[kind]);
      for (int i = 0; i < g.count[kind]; ++i) {
        const Block& block = groups_.blocks()[g.first[kind] + i / kBlockLanes];
        const int lane = i % kBlockLanes;
        names.push_back({block.id[lane],
                         {block.vertex[0][lane], block.vertex[1][lane], block.vertex[2][lane]}});
      }
    }
    names.resize((names.size() + kPlaceUnit - 1) / kPlaceUnit * kPlaceUnit);
    groups.push_back(group);
  }
  reserve_places(names.size());
  upload(device_groups_, groups.data(), groups.size());
  upload(names_, names.data(), names.size());
}

BoxArrays DeviceScene::box_arrays() {
  auto* const xy = reinterpret_cast<uint4*>(boxes_.data());
  return {xy, reinterpret_cast<uint2*>(xy + places_)};
}

SceneView DeviceScene::view(bool is_double) {
  SceneView s{};
  s.vertex_count = static_cast<std::uint32_t>(mesh_->vertex_count());
  s.group_count = group_count();
  s.node_count = node_count();
  s.groups = {device_groups_.data(),
              box_arrays(),
              names_.data(),
              bounds_.data(),
              arrays_.bodies.data(),
              arrays_.disabled_pairs.data(),
              static_cast<std::uint32_t>(mesh_->disabled_pairs().size())};
  s.mesh = {reinterpret_cast<const std::int32_t(*)[3]>(arrays_.faces.data()),
            reinterpret_cast<const std::int32_t(*)[2]>(arrays_.edges.data()),
            arrays_.body_of_vertex.data()};
  s.pinned =
      mesh_->any_pinned() ? reinterpret_cast<const unsigned char*>(arrays_.pinned.data()) : nullptr;
  s.leaf_order = leaf_order_.data();
  s.node_ranges = node_ranges_.data();
  s.key = key();
  if (s.key.world_of_body != nullptr) s.key.world_of_body = arrays_.world_of_body.data();
  s.separation = {separation_, mesh_->self_separation() ? arrays_.self_separation.data() : nullptr};
  if (separation_ > 0) s.near = near_view();
  s.is_double = is_double;
  s.records = records_.data();
  s.runs = runs_.data();
  s.nodes = nodes_.data();
  return s;
}

NearView DeviceScene::near_view() {
  const auto if_any = [](Span<const char> flags, const DeviceBuffer<char>& buffer) {
    return flags.empty() ? nullptr : buffer.data();
  };
  NearView near{};
  if (reduces_ && mesh_->first_faces().of != nullptr)
    near.first_faces = {arrays_.first_faces.data(), mesh_->first_faces().edges,
                        reinterpret_cast<const std::int32_t(*)[3]>(arrays_.face_edges.data())};
  near.edges_left_out = if_any(mesh_->edges_left_out(), arrays_.edges_left_out);
  near.vertices_left_out = if_any(mesh_->vertices_left_out(), arrays_.vertices_left_out);
  near.resting = resting_.data();
  near.min_distance = reinterpret_cast<unsigned long long*>(near_distances_.data());
  return near;
}

ContactKey DeviceScene::key() const { return mesh_->contact_key(); }

std::size_t DeviceScene::bytes() const {
  return arrays_.bytes() + device_groups_.bytes() + leaf_order_.bytes() + node_ranges_.bytes() +
         names_.bytes() + records_.bytes() + boxes_.bytes() + bounds_.bytes() + runs_.bytes() +
         nodes_.bytes() + resting_.bytes() + near_distances_.bytes();
}

}  // namespace lazyccd::gpu
