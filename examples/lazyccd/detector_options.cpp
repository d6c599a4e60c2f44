#include "detector_options.h"

#include <map>

namespace lazyccd::program {

void add_detector_options(CLI::App& command, Options& options) {
  static const std::map<std::string, Backend> backends = {
      {"auto", Backend::automatic}, {"cpu", Backend::cpu}, {"cuda", Backend::cuda}};
  command
      .add_option("--backend", options.backend,
                  "auto (cuda where a device answers, else cpu), cpu or cuda")
      ->transform(CLI::CheckedTransformer(backends).description("{auto,cpu,cuda}"));
  command
      .add_option("--threads", options.threads,
                  "threads of the cpu backend; 0: as many as the machine has")
      ->check(CLI::Range(0, 1024));
}

}  // namespace lazyccd::program
