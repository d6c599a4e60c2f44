// What a detection did and cost, for files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "lazyccd/stats.h"

namespace lazyccd::program {

nlohmann::ordered_json to_json(const Stats& stats);

// 16 hexadecimal digits: JSON numbers do not hold 64 bits everywhere.
std::string hash_text(std::uint64_t hash);

void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json);

}  // namespace lazyccd::program
