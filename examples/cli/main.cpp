// The program lazyccd: collision detection from the command line.
#include <cstdio>
#include <exception>

#include "cli/commands.h"
#include "lazyccd/algorithm.h"

namespace {

enum ExitCode { succeeded = 0, failed = 1, bad_usage = 2 };

}  // namespace

int main(int argc, char** argv) {
  lazyccd::register_research();
  CLI::App app("Exact continuous collision detection of triangle meshes", "lazyccd");
  app.require_subcommand(1);
  app.footer(
      "`lazyccd COMMAND --help` explains a command and shows an example.\n"
      "Exit codes: 0 success, 1 failure, 2 wrong usage.");
  lazyccd::program::add_detect(app);
  lazyccd::program::add_queries(app);
  lazyccd::program::add_bench(app);
  lazyccd::program::add_models(app);
  lazyccd::program::add_study(app);
#if defined(LAZYCCD_WITH_BULLET)
  lazyccd::program::add_simulate(app);
  lazyccd::program::add_scenes(app);
#endif
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? succeeded : bad_usage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "lazyccd: %s\n", error.what());
    return failed;
  }
  return succeeded;
}
