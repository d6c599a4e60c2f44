// lazyccd scenes: lists the scenes of `lazyccd simulate`.
#include <cstdio>

#include "cli/commands.h"
#include "scenes/scene.h"

namespace lazyccd::program {

void add_scenes(CLI::App& app) {
  CLI::App* command = app.add_subcommand("scenes", "List the scenes of `lazyccd simulate`");
  command->footer("Example: lazyccd scenes");
  command->callback([] {
    for (const scenes::SceneInfo& scene : scenes::all_scenes()) {
      std::printf("%-20s %s", scene.name.c_str(), scene.description.c_str());
      if (scene.speed > 0) std::printf(" (%g m/s)", scene.speed);
      std::printf("\n");
    }
  });
}

}  // namespace lazyccd::program
