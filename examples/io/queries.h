// Files of elementary queries, for the narrow phase by itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "lazyccd/query.h"

namespace lazyccd::io {

struct QueryFile {
  std::vector<QueryPoints> points;
  std::vector<std::uint8_t> truth;  // 0 or 1 a query; empty where the file carries none
  std::size_t rounded = 0;          // coordinates of a .csv that no double holds exactly
};

// By the name's ending:
//   .csv  eight rows a query (four points at the start, then the same four at the end), six columns
//   a
//         row: numerator and denominator of x, y, z; a seventh, the same in all eight rows, is the
//         truth
//   .bin  int32 n, n x 24 float64 (in the order of the .csv), n bytes of truth; little-endian
// Throws Error (file) naming line or byte.
QueryFile read_queries(const std::filesystem::path& path);
QueryFile parse_queries_csv(std::string_view text, const std::string& name);
QueryFile parse_queries_bin(std::string_view bytes, const std::string& name);

}  // namespace lazyccd::io
