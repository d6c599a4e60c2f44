// The options of the detector that every command with one has.
#pragma once

#include <CLI/CLI.hpp>

#include "lazyccd/detector.h"

namespace lazyccd::program {

// Adds --backend, --threads and --strategy; `options` must live as long as the command.
void add_detector_options(CLI::App& command, DetectorOptions& options);

}  // namespace lazyccd::program
