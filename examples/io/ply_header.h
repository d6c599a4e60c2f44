// The header of a PLY file: the elements that follow and their properties.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/ply.h"

namespace lazyccd::io {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// Returns the size of a value in bytes.
std::size_t size_of(PlyType type);
inline bool is_integer(PlyType type) { return type < PlyType::float32; }

struct PlyProperty {
  std::string name;
  PlyType type;
  std::optional<PlyType> count_type;  // type of the length of a list; empty: not a list
};

struct PlyElement {
  std::string name;
  std::size_t count;
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyFormat format;
  std::vector<PlyElement> elements;
  std::size_t bytes;  // length of the header with its last line end
  std::size_t lines;
};

/// Parses the header at the start of `bytes`. Throws Error(file) that names the line; `name` is for
/// messages.
PlyHeader parse_ply_header(std::string_view bytes, const std::string& name);

}  // namespace lazyccd::io
