// Runs each scene of the library with one soft body more, which gets lost, and prints what that
// changes for all others.
//
//   lazyccd_lost_bodies --steps 120
//
// Exit code 1 if it changes anything in the rigid world, or anything by more than a tenth of the
// thickness in the deformable one.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "random/lost_body.h"

using namespace lazyccd;

int main(int argc, char** argv) {
  CLI::App app("Scenes with a lost body");
  std::string only;
  int steps = 120;
  bool with_bullet_alone = false;
  app.add_option("--scene", only);
  app.add_option("--steps", steps);
  app.add_flag("--bullet", with_bullet_alone, "Bullet alone");
  CLI11_PARSE(app, argc, argv);
  int faults = 0, runs = 0;
  for (const scenes::SceneInfo& info : scenes::all_scenes()) {
    if (!only.empty() && info.name != only) continue;
    for (const scenes::World world : {scenes::World::rigid, scenes::World::deformable}) {
      for (const test::Loss loss : test::all_losses) {
        scenes::Parameters parameters;
        parameters.world = world;
        parameters.size = 0.5;
        parameters.dt = 1.0 / (world == scenes::World::rigid ? 60 : 240);
        parameters.steps = steps;
        if (with_bullet_alone) parameters.collisions = scenes::Collisions::bullet;
        const test::LostBodyReport report = test::run_with_lost_body(info, parameters, loss);
        const bool is_fault = world == scenes::World::rigid
                                  ? !report.is_same
                                  : !(report.farthest <= report.thickness / 10);
        ++runs;
        faults += is_fault;
        std::printf("%-24s %-10s %-12s %-7s %9.3g m  %6.2f %6.2f ms  %s\n", info.name.c_str(),
                    world == scenes::World::rigid ? "rigid" : "deformable", test::name_of(loss),
                    report.is_same ? "same" : (is_fault ? "FAULT" : "near"), report.farthest,
                    report.ms_per_step_without, report.ms_per_step,
                    is_fault ? report.status.c_str() : "");
        std::fflush(stdout);
      }
    }
  }
  std::printf("%d of %d runs with a fault\n", faults, runs);
  return faults == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
