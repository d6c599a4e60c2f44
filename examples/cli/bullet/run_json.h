// Writes what a run of a scene did and cost as JSON.
#pragma once

#include <nlohmann/json.hpp>

#include "scenes/run.h"

namespace lazyccd::program {

nlohmann::ordered_json to_json(const scenes::RunReport& report);

}  // namespace lazyccd::program
