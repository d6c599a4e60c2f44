// lazyccd detect: finds all contacts between two frames of one mesh.
#include <cinttypes>
#include <cstdio>
#include <memory>

#include "cli/commands.h"
#include "cli/detector_options.h"
#include "cli/stats_json.h"
#include "io/mesh.h"
#include "io/ply.h"
#include "io/results.h"
#include "lazyccd/detector.h"

namespace lazyccd::program {

namespace {

struct DetectArguments {
  std::string start, end;
  DetectorOptions options;
  std::string out, stats;
};

void print_summary(const Detector& detector) {
  const Stats& stats = detector.stats();
  std::printf("%s\n", detector.status().c_str());
  std::printf("%" PRId64 " vertices, %" PRId64 " edges, %" PRId64 " faces\n", stats.vertices,
              stats.edges, stats.faces);
  std::printf("%" PRId64 " vertex-face and %" PRId64 " edge-edge contacts, hash %s\n",
              stats.contacts_vf, stats.contacts_ee, hash_text(stats.hash).c_str());
  std::printf("%.1f ms: refit %.1f, traverse %.1f, sort %.1f\n", stats.ms_total, stats.ms_refit,
              stats.ms_traverse, stats.ms_sort);
}

void run_detect(const DetectArguments& arguments) {
  const io::Mesh start = io::read_ply(arguments.start);
  const io::Mesh end = io::read_ply(arguments.end);
  io::require_same_topology(start, arguments.start, end, arguments.end);

  Detector detector(arguments.options);
  detector.set_topology(io::topology(start));
  const Span<const Contact> contacts = detector.detect(io::positions(start), io::positions(end));

  if (!arguments.out.empty()) io::write_contacts_csv(arguments.out, contacts);
  if (!arguments.stats.empty()) write_json(arguments.stats, to_json(detector.stats()));
  print_summary(detector);
}

}  // namespace

void add_detect(CLI::App& app) {
  const auto arguments = std::make_shared<DetectArguments>();
  CLI::App* command = app.add_subcommand(
      "detect", "Find every contact of a mesh that moves from one frame to the next");
  command->add_option("START", arguments->start, "PLY file of the mesh at the start of the step")
      ->required();
  command->add_option("END", arguments->end, "PLY file of the same mesh at the end of the step")
      ->required();
  add_detector_options(*command, arguments->options);
  command
      ->add_option("--separation", arguments->options.separation,
                   "minimum separation, in the unit of the positions: primitives that come as near "
                   "are in contact")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--out", arguments->out, "write the contacts, with columns kind,p0,p1,p2,p3,toi")
      ->type_name("FILE.csv");
  command->add_option("--stats", arguments->stats, "write counts, and the time of each stage")
      ->type_name("FILE.json");
  command->footer(
      "Kind vf in the CSV: vertex p0 and face p1 p2 p3. Kind ee: edge p0 p1 and edge p2 p3.\n"
      "Vertices are numbered as in the PLY files. toi is the time of impact, from 0 (start) to\n"
      "1 (end).\n"
      "Example: lazyccd detect 92.ply 93.ply --threads 2 --out contacts.csv --stats stats.json");
  command->callback([arguments] { run_detect(*arguments); });
}

}  // namespace lazyccd::program
