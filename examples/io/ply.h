// Triangle meshes in PLY files: ASCII, binary little and big endian.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "io/mesh.h"

namespace lazyccd::io {

// Reads x, y, z of the element `vertex` and the list `vertex_indices` (or `vertex_index`) of the
// element `face`, of any numeric type; other properties and elements are passed over. Throws Error
// (file), naming line or byte, on a face without exactly three corners, an index out of range, a
// position that is not finite, and anything that is not such a file or only the beginning of one.
Mesh read_ply(const std::filesystem::path& path);
Mesh parse_ply(std::string_view bytes, const std::string& name);

enum class PlyFormat { ascii, binary_little_endian, binary_big_endian };
enum class PlyScalar { float32, float64 };

void write_ply(const std::filesystem::path& path, const Mesh& mesh,
               PlyFormat format = PlyFormat::binary_little_endian,
               PlyScalar scalar = PlyScalar::float64);

}  // namespace lazyccd::io
