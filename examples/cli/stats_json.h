// Writes what a detection did and cost as JSON.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "lazyccd/stats.h"

namespace lazyccd::program {

nlohmann::ordered_json to_json(const Stats& stats);

/// Returns a hash as 16 hexadecimal digits, because not every reader keeps 64 bits of a JSON
/// number.
std::string hash_text(std::uint64_t hash);

/// Writes a JSON file. Throws Error(file) if that fails.
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json);

}  // namespace lazyccd::program
