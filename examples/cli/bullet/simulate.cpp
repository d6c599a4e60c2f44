// lazyccd simulate: runs a scene in Bullet, with LazyCCD or with Bullet alone.
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>

#include "cli/bullet/run_json.h"
#include "cli/commands.h"
#include "cli/detector_options.h"
#include "cli/stats_json.h"
#include "io/ply.h"
#include "scenes/meshes/surface.h"
#include "scenes/run.h"

#if defined(LAZYCCD_WITH_RENDER)
#include "cli/film/recorder.h"
#endif

namespace lazyccd::program {

namespace {

struct Arguments {
  std::string scene;
  scenes::Parameters parameters;
  double dt = 0, speed = 0, margin = 0;
  int steps = 0;
  std::string out, stats, render;
  int width = 640, samples = 16;
  std::optional<int> every;
  bool progress = false;
};

void write_frame(const scenes::Scene& scene, const std::filesystem::path& folder, int step) {
  char name[32];
  std::snprintf(name, sizeof(name), "%05d.ply", step);
  const scenes::Surface surface = scenes::read_surface(*scene.world);
  io::write_ply(folder / name, scenes::to_mesh(surface, scenes::read_positions(*scene.world)));
}

void print_progress(int step, int steps) {
  constexpr int width = 40;
  const int done = width * step / std::max(1, steps);
  std::fprintf(stderr, "\r[%.*s%.*s] %d/%d", done, "########################################",
               width - done, "                                        ", step, steps);
  if (step == steps) std::fprintf(stderr, "\n");
}

void print_summary(const scenes::RunReport& report) {
  const bullet::StepStats& stats = report.lazyccd;
  std::printf("%d steps, %.2f ms a step\n", report.steps, report.mean.total);
  if (!report.finite) std::printf("stopped: a position is no longer finite\n");
  std::printf("pass-throughs: %" PRId64 " vertex-face, %" PRId64 " edge-edge\n",
              report.crossings_vf, report.crossings_ee);
  std::printf("edge-face intersections at the end: %zu\n", report.intersections.size());
  if (report.wrong_side) std::printf("nodes on the wrong side: %d\n", *report.wrong_side);
  if (stats.steps == 0) return;
  std::printf("contacts: %" PRId64 " vertex-face, %" PRId64 " edge-edge; %" PRId64 " detections\n",
              stats.contacts_vf, stats.contacts_ee, stats.detections);
  std::printf("nodes in impact zones: %" PRId64 ", held by the fail-safe: %" PRId64 "\n",
              stats.impact_zone_nodes, stats.failsafe_holds);
  std::printf("%s", report.status.c_str());
}

void run(const Arguments& arguments) {
  const scenes::SceneInfo& info = *scenes::find_scene(arguments.scene);
  scenes::Scene scene = scenes::set_up(info, arguments.parameters);
  if (!arguments.out.empty()) std::filesystem::create_directories(arguments.out);
  constexpr int film_frames = 100;
  const int every = arguments.every.value_or(
      arguments.render.empty() ? 1 : std::max(1, scene.steps / film_frames));
#if defined(LAZYCCD_WITH_RENDER)
  std::optional<Recorder> recorder;
  if (!arguments.render.empty()) {
    recorder.emplace(scene, arguments.render, arguments.width, arguments.samples);
  }
#endif
  const scenes::RunReport report = scenes::run(scene, [&](int step) {
    const bool frame = step % every == 0 || step == scene.steps;
    if (!arguments.out.empty() && frame) write_frame(scene, arguments.out, step);
#if defined(LAZYCCD_WITH_RENDER)
    if (recorder && frame) recorder->add(step);
#endif
    if (arguments.progress) print_progress(step, scene.steps);
  });
#if defined(LAZYCCD_WITH_RENDER)
  if (recorder) recorder->finish();
#endif
  if (!arguments.stats.empty()) write_json(arguments.stats, to_json(report));
  print_summary(report);
}

}  // namespace

void add_simulate(CLI::App& app) {
  static const std::map<std::string, scenes::World> worlds = {
      {"rigid", scenes::World::rigid}, {"deformable", scenes::World::deformable}};
  static const std::map<std::string, scenes::Collisions> detectors = {
      {"lazyccd", scenes::Collisions::lazyccd},
      {"bullet", scenes::Collisions::bullet},
      {"mended-bullet", scenes::Collisions::mended_bullet}};
  std::vector<std::string> names;
  for (const scenes::SceneInfo& scene : scenes::all_scenes()) names.push_back(scene.name);

  const auto arguments = std::make_shared<Arguments>();
  scenes::Parameters& parameters = arguments->parameters;
  CLI::App* command =
      app.add_subcommand("simulate", "Run a scene in Bullet and count what goes wrong");
  command->add_option("SCENE", arguments->scene, "name of a scene from `lazyccd scenes`")
      ->required()
      ->check(CLI::IsMember(names));
  command
      ->add_option(
          "--world", parameters.world,
          "rigid (btSoftRigidDynamicsWorld) or deformable (btDeformableMultiBodyDynamicsWorld)")
      ->transform(CLI::CheckedTransformer(worlds).description("{rigid,deformable}"));
  command
      ->add_option(
          "--detector", parameters.collisions,
          "lazyccd; bullet: Bullet alone; mended-bullet: Bullet alone, with corrected momentum")
      ->transform(CLI::CheckedTransformer(detectors).description("{lazyccd,bullet,mended-bullet}"));
  add_detector_options(*command, parameters.lazyccd.detector);
  const auto optional = [command](const char* name, auto& value, auto& target, const char* help) {
    return command->add_option_function<std::decay_t<decltype(value)>>(
        name, [&target](const auto& given) { target = given; }, help);
  };
  optional("--dt", arguments->dt, parameters.dt, "time step in seconds; default 1/240")
      ->check(CLI::Range(1e-6, 1.0));
  optional("--speed", arguments->speed, parameters.speed,
           "speed of the thrown or driven bodies, m/s; default: the scene's")
      ->check(CLI::Range(0.0, 1e6));
  optional("--margin", arguments->margin, parameters.margin,
           "collision margin of each body, metres; default: the scene's")
      ->check(CLI::Range(0.0, 1e3));
  optional("--steps", arguments->steps, parameters.steps, "number of steps; default: the scene's")
      ->check(CLI::Range(0, 100000000));
  command->add_option("--seed", parameters.seed, "seed of the random offsets of the nodes");
  command
      ->add_option("--size", parameters.size,
                   "factor of the number of nodes along each side of a cloth")
      ->check(CLI::Range(0.05, 100.0));
  command->add_option("--out", arguments->out, "write frames as PLY: DIR/00000.ply and so on")
      ->type_name("DIR");
  command
      ->add_option(
          "--every", arguments->every,
          "write every N-th frame and the last; default: all, or about 100 frames with --render")
      ->check(CLI::Range(1, 1000000));
#if defined(LAZYCCD_WITH_RENDER)
  command
      ->add_option("--render", arguments->render,
                   "draw frames: DIR/00000.png and so on, and the film DIR/film.webp")
      ->type_name("DIR");
  command->add_option("--width", arguments->width, "width of the pictures, pixels")
      ->check(CLI::Range(16, 8192))
      ->capture_default_str();
  command
      ->add_option("--samples", arguments->samples,
                   "rays for each pixel; more rays give less noise")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
#endif
  command->add_option("--stats", arguments->stats, "write counters, energies and times")
      ->type_name("FILE.json");
  command->add_flag("--progress", arguments->progress, "show a progress bar");
  command->footer(
      "A pass-through is a pair of primitives that comes into contact between the end positions\n"
      "of two consecutive steps. An edge-face intersection is an edge that passes through a face\n"
      "at the end of the run (`intersections` in the JSON file).\n"
      "Example: lazyccd simulate cloth-on-cloth --speed 30 --dt 0.0166667 --detector bullet");
  parameters.lazyccd.measure_energy = true;
  command->callback([arguments] { run(*arguments); });
}

}  // namespace lazyccd::program
