// One function a subcommand: it adds its options to the program and runs when chosen. Failures are
// thrown; main turns them into a message and exit code 1.
#pragma once

#include <CLI/CLI.hpp>

namespace lazyccd::program {

void add_detect(CLI::App& app);
void add_queries(CLI::App& app);
void add_bench(CLI::App& app);
void add_models(CLI::App& app);
void add_study(CLI::App& app);
#if defined(LAZYCCD_WITH_BULLET)
void add_simulate(CLI::App& app);
void add_scenes(CLI::App& app);
#endif

}  // namespace lazyccd::program
