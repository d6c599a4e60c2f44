// Triangle meshes in PLY files: ASCII, binary little and big endian.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/mesh.h"

namespace lazyccd::io {

/// Reads x, y, z of the element `vertex` and the list `vertex_indices` (or `vertex_index`) of the
/// element `face`, of any numeric type. Skips other properties and elements. Throws Error(file)
/// that names the line or byte, if the file is not a PLY file or is cut short. So it does if a face
/// does not have exactly three corners, an index is out of range, or a position is not finite.
Mesh read_ply(const std::filesystem::path& path);
/// Does the same for the bytes of a file; `name` is for messages.
Mesh parse_ply(std::string_view bytes, const std::string& name);

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };
enum class PlyScalar { float32, float64 };

/// Writes a mesh. Throws Error(file) if that fails.
void write_ply(const std::filesystem::path& path, const Mesh& mesh,
               PlyFormat format = PlyFormat::binary_little_endian,
               PlyScalar scalar = PlyScalar::float64);

}  // namespace lazyccd::io
