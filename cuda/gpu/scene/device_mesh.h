// The mesh in device memory.
#pragma once

#include <cstddef>
#include <cstdint>

#include "gpu/device/device_buffer.h"
#include "host/scene/mesh.h"

namespace lazyccd::gpu {

/// The arrays of Mesh. Faces to primitives come from the host's mesh or are found on the device
/// (gpu/topology); the others are small and always come from the host.
struct DeviceMesh {
  DeviceBuffer<Face> faces;
  DeviceBuffer<Edge> edges;
  DeviceBuffer<std::int32_t> face_edges;  // three per face
  DeviceBuffer<std::int32_t> body_of_vertex;
  DeviceBuffer<std::int32_t> primitives;  // by cell
  bool has_primitives = false;            // if not, cell c is face c

  DeviceBuffer<char> pinned;            // by vertex, if any is
  DeviceBuffer<float> self_separation;  // by vertex, if there are limits
  // Only with a separation:
  DeviceBuffer<std::int32_t> first_faces;                // as FirstFaces::of
  DeviceBuffer<char> edges_left_out, vertices_left_out;  // by edge; by vertex; if any is
  DeviceBuffer<Body> bodies;
  DeviceBuffer<std::uint64_t> disabled_pairs;  // sorted
  DeviceBuffer<std::int32_t> world_of_body;
  DeviceBuffer<CellSegment> segments;
  DeviceBuffer<std::int32_t> worlds;  // by group, if there are several

  /// Uploads faces to primitives of a complete mesh.
  void upload_primitives(const Mesh& mesh);
  /// Uploads the others. has_separation: also what only steps with a separation read.
  void upload_tables(const Mesh& mesh, bool has_separation);
  std::size_t bytes() const;
};

}  // namespace lazyccd::gpu
