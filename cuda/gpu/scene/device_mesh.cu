// Upload of the mesh.
#include "gpu/scene/device_mesh.h"

#include <algorithm>
#include <vector>

#include "gpu/device/upload.h"

namespace lazyccd::gpu {

void DeviceMesh::upload_primitives(const Mesh& mesh) {
  static_assert(sizeof(Face) == 3 * sizeof(std::int32_t));
  upload(faces, mesh.faces().data(), mesh.faces().size());
  upload(edges, mesh.edges().data(), mesh.edges().size());
  upload(face_edges, mesh.face_edges().data(), 3 * mesh.face_edges().size());
  upload(body_of_vertex, mesh.body_of_vertex().data(), mesh.vertex_count());
  upload(primitives, mesh.cells().primitives().data(), mesh.cells().primitives().size());
  has_primitives = true;
}

void DeviceMesh::upload_tables(const Mesh& mesh, bool has_separation) {
  upload(pinned, mesh.pinned_vertices().data(), mesh.pinned_vertices().size());
  upload(self_separation, mesh.self_separation(), mesh.self_separation() ? mesh.vertex_count() : 0);
  if (has_separation) {
    const bool has_faces = mesh.first_faces().of != nullptr;
    upload(first_faces, mesh.first_faces().of,
           has_faces ? mesh.edges().size() + mesh.vertex_count() : 0);
    upload(edges_left_out, mesh.edges_left_out().data(), mesh.edges_left_out().size());
    upload(vertices_left_out, mesh.vertices_left_out().data(), mesh.vertices_left_out().size());
  }
  upload(bodies, mesh.bodies().data(), mesh.body_count());
  std::vector<std::uint64_t> disabled(mesh.disabled_pairs().begin(), mesh.disabled_pairs().end());
  std::sort(disabled.begin(), disabled.end());
  upload(disabled_pairs, disabled.data(), disabled.size());
  upload(world_of_body, mesh.world_of_body().data(), mesh.world_of_body().size());
  const std::vector<CellSegment>& all = mesh.cells().segments();
  upload(segments, all.data(), all.size());
  std::vector<std::int32_t> of_group;
  if (!mesh.world_of_body().empty()) {
    of_group.reserve(mesh.cells().group_count());
    for (const CellSegment& segment : all)
      of_group.insert(of_group.end(), static_cast<std::size_t>(segment.groups()),
                      mesh.world_of_body()[static_cast<std::size_t>(segment.body)]);
  }
  upload(worlds, of_group.data(), of_group.size());
}

std::size_t DeviceMesh::bytes() const {
  return faces.bytes() + edges.bytes() + face_edges.bytes() + body_of_vertex.bytes() +
         primitives.bytes() + pinned.bytes() + self_separation.bytes() + first_faces.bytes() +
         edges_left_out.bytes() + vertices_left_out.bytes() + bodies.bytes() +
         disabled_pairs.bytes() + world_of_body.bytes() + segments.bytes() + worlds.bytes();
}

}  // namespace lazyccd::gpu
