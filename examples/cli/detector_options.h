// Command-line options that all commands with a detector share.
#pragma once

#include <CLI/CLI.hpp>

#include "lazyccd/detector.h"

namespace lazyccd::program {

/// Adds --backend, --threads and --strategy. `options` must outlive the command.
void add_detector_options(CLI::App& command, DetectorOptions& options);

}  // namespace lazyccd::program
