#include "cli/detector_options.h"

#include <map>

namespace lazyccd::program {

void add_detector_options(CLI::App& command, DetectorOptions& options) {
  static const std::map<std::string, Backend> backends = {
      {"auto", Backend::automatic}, {"cpu", Backend::cpu}, {"cuda", Backend::cuda}};
  command
      .add_option("--backend", options.backend,
                  "auto (cuda if a device answers, else cpu), cpu or cuda")
      ->transform(CLI::CheckedTransformer(backends).description("{auto,cpu,cuda}"));
  command
      .add_option("--threads", options.threads,
                  "number of threads of the cpu backend; 0: as many as there are cores")
      ->check(CLI::Range(0, 1024));
  static const std::map<std::string, Strategy> strategies = [] {
    std::map<std::string, Strategy> named;
    for (const Strategy strategy : kStrategies) named[name(strategy)] = strategy;
    return named;
  }();
  std::string names;
  for (const Strategy strategy : kStrategies)
    names += (names.empty() ? "{" : ",") + std::string(name(strategy));
  command
      .add_option(
          "--strategy", options.algorithm.strategy,
          "how the traversal shares its work among threads or blocks; default lazy_stealing")
      ->transform(CLI::CheckedTransformer(strategies).description(names + "}"));
}

}  // namespace lazyccd::program
