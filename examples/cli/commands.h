// The subcommands of lazyccd. Each function adds one subcommand with its options to the program. A
// subcommand runs if the user chose it. It throws on failure; main() prints the message and exits
// with code 1.
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
