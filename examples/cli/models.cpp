// lazyccd models: lists the generated models and writes their frames to files.
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "cli/commands.h"
#include "io/ply.h"
#include "models/model.h"

namespace lazyccd::program {

namespace {

struct ModelArguments {
  std::string model, out;
  std::uint64_t seed = 1;
  int first = 0, last = models::Model::frames - 1;
};

void run_models(const ModelArguments& arguments) {
  if (arguments.model.empty()) {
    for (const models::ModelName& m : models::model_names())
      std::printf("%-12s %s\n", m.name, m.meaning);
    return;
  }
  const auto model = models::make_model(arguments.model, arguments.seed);
  std::filesystem::create_directories(arguments.out);
  io::Mesh mesh;
  mesh.faces = model->faces();
  mesh.vertices.resize(model->vertex_count());
  for (int frame = arguments.first; frame <= arguments.last; ++frame) {
    const std::vector<float> x = model->frame(frame);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
      mesh.vertices[v] = {x[3 * v], x[3 * v + 1], x[3 * v + 2]};
    const auto path = std::filesystem::path(arguments.out) /
                      (arguments.model + "-" + std::to_string(frame) + ".ply");
    io::write_ply(path, mesh, io::PlyFormat::binary_little_endian, io::PlyScalar::float32);
  }
  std::printf("%d frames of %zu faces in %s\n", arguments.last - arguments.first + 1,
              mesh.faces.size(), arguments.out.c_str());
}

}  // namespace

void add_models(CLI::App& app) {
  const auto arguments = std::make_shared<ModelArguments>();
  CLI::App* command =
      app.add_subcommand("models", "List the generated models, or write frames of one model");
  command->add_option("MODEL", arguments->model,
                      "name of a model; without it, all models are listed");
  command->add_option("--seed", arguments->seed, "seed of the generator");
  command->add_option("--first", arguments->first, "first frame")
      ->check(CLI::Range(0, models::Model::frames - 1));
  command->add_option("--last", arguments->last, "last frame")
      ->check(CLI::Range(0, models::Model::frames - 1));
  command->add_option("--out", arguments->out, "folder for MODEL-FRAME.ply; created if missing")
      ->type_name("FOLDER")
      ->default_str(".");
  command->footer("Example: lazyccd models funnel --first 50 --last 51 --out frames");
  command->callback([arguments] {
    if (arguments->out.empty()) arguments->out = ".";
    run_models(*arguments);
  });
}

}  // namespace lazyccd::program
