// Readers of files of elementary queries, which test the narrow phase by itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "lazyccd/query.h"

namespace lazyccd::io {

/// The contents of a file.
struct QueryFile {
  std::vector<QueryPoints> points;
  std::vector<std::uint8_t> truth;  // 0 or 1 a query; empty: the file has none
  std::size_t rounded = 0;          // coordinates of a .csv that no double represents exactly
};

/// Reads a file. The ending of its name selects the format:
///   .csv  Eight rows a query: four points at the start, then the same four at the end.
///         Six columns: numerator and denominator of x, y and z. An optional seventh column is the
///         truth, the same in all eight rows.
///   .bin  Little-endian: int32 n, n x 24 float64 (in the order of the .csv), n bytes of truth.
/// Throws Error(file) that names the line or byte.
QueryFile read_queries(const std::filesystem::path& path);
QueryFile parse_queries_csv(std::string_view text, const std::string& name);
QueryFile parse_queries_bin(std::string_view bytes, const std::string& name);

}  // namespace lazyccd::io
