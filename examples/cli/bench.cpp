// lazyccd bench: times whole detections stage by stage, for each backend and strategy.
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <vector>

#include "cli/commands.h"
#include "io/mesh.h"
#include "io/ply.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"

namespace lazyccd::program {

namespace {

struct BenchArguments {
  std::vector<std::string> frames;
  std::vector<std::string> backends{"cpu", "cuda"};
  std::vector<std::string> strategies;
  int threads = 0, repeat = 20, warm_up = 5;
  std::string csv, label;
};

// One row of a scene's table: a backend, a strategy and a way to start.
struct BenchSetting {
  std::string backend, strategy, mode;
  DetectorOptions options;
  // The start is already on the GPU, as the end of the previous step. So it is in a simulation.
  bool resident = false;
};

struct Column {
  const char* name;
  std::function<double(const Stats&)> value;
};

const Column kTimes[] = {
    {"total", [](const Stats& s) { return s.ms_total; }},
    {"device", [](const Stats& s) { return s.ms_device; }},
    {"upload", [](const Stats& s) { return s.ms_upload; }},
    {"refit", [](const Stats& s) { return s.ms_refit; }},
    {"traverse", [](const Stats& s) { return s.ms_traverse; }},
    {"leaf", [](const Stats& s) { return s.ms_leaf; }},
    {"narrow", [](const Stats& s) { return s.ms_narrow; }},
    {"sort", [](const Stats& s) { return s.ms_sort; }},
};

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

// Returns the settings that are worth measuring. On the GPU these are, for each strategy, the CUDA
// graph as it is normally used and the single stages (their sum is a little more than the graph's
// time). lazy_stealing is also measured from the root and with a resident start.
std::vector<BenchSetting> bench_settings(const BenchArguments& arguments) {
  std::vector<BenchSetting> all;
  for (const std::string& backend : arguments.backends) {
    DetectorOptions options;
    options.threads = arguments.threads;
    if (backend == "cpu") {
      options.backend = Backend::cpu;
      all.push_back({backend, "lazy_stealing", "from the root", options});
      continue;
    }
    options.backend = Backend::cuda;
    for (const std::string& strategy : arguments.strategies) {
      options.algorithm.strategy = parse_strategy(strategy);
      options.algorithm.tuning.graph = true;
      all.push_back({backend, strategy, "graph", options});
      if (options.algorithm.strategy == Strategy::lazy_stealing)
        all.push_back({backend, strategy, "graph, start resident", options, true});
      options.algorithm.tuning.graph = false;
      all.push_back({backend, strategy, "stages", options});
      if (options.algorithm.strategy == Strategy::lazy_stealing) {
        options.algorithm.front = FrontUse::off;
        all.push_back({backend, strategy, "stages, from the root", options});
        options.algorithm.front = FrontUse::automatic;
      }
    }
  }
  return all;
}

void run_scene(const BenchArguments& arguments, const std::string& start_name,
               const std::string& end_name, std::ofstream& csv) {
  const io::Mesh start = io::read_ply(start_name), end = io::read_ply(end_name);
  io::require_same_topology(start, start_name, end, end_name);
  std::printf("\n%s: %zu faces\n", start_name.c_str(), start.faces.size());
  std::printf("%-5s %-17s %-22s", "", "strategy", "mode");
  for (const Column& column : kTimes) std::printf("%9s", column.name);
  std::printf("%10s %9s  hash\n", "contacts", "exact");

  std::uint64_t hash = 0;
  bool first = true;
  for (const BenchSetting& setting : bench_settings(arguments)) {
    Detector detector(setting.options);
    detector.set_topology(io::topology(start));
    std::vector<std::vector<double>> times(std::size(kTimes));
    for (int i = 0; i < arguments.warm_up + arguments.repeat; ++i) {
      if (setting.resident) detector.detect(io::positions(end), io::positions(start));
      detector.detect(io::positions(start), io::positions(end));
      if (detector.stats().backend != setting.backend)
        throw Error(ErrorCode::unavailable, detector.status());
      if (first) hash = detector.stats().hash;
      first = false;
      if (detector.stats().hash != hash)
        throw Error(ErrorCode::device,
                    "the contacts differ (hash): " + setting.backend + " " + setting.strategy);
      if (i < arguments.warm_up) continue;
      for (std::size_t t = 0; t < times.size(); ++t)
        times[t].push_back(kTimes[t].value(detector.stats()));
    }
    const Stats& s = detector.stats();
    std::printf("%-5s %-17s %-22s", setting.backend.c_str(), setting.strategy.c_str(),
                setting.mode.c_str());
    for (const auto& t : times) std::printf("%9.3f", percentile(t, 0.5));
    std::printf("%10" PRId64 " %9" PRId64 "  %016" PRIx64 "\n", s.contacts_vf + s.contacts_ee,
                s.exact_tests, s.hash);
    std::fflush(stdout);
    if (!csv) continue;
    csv << start_name << ',' << setting.backend << ',' << setting.strategy << ",\"" << setting.mode
        << "\"," << arguments.repeat;
    for (const auto& t : times) csv << ',' << percentile(t, 0.5) << ',' << percentile(t, 0.95);
    csv << ',' << s.contacts_vf << ',' << s.contacts_ee << ',' << std::hex << s.hash << std::dec
        << ',' << s.tree_tests << ',' << s.front_nodes << ',' << s.group_pairs << ','
        << s.candidates_vf + s.candidates_ee << ',' << s.survivors_vf + s.survivors_ee << ','
        << s.double_precision_tests << ',' << s.exact_tests << ',' << s.steals << ','
        << s.idle_share << ',' << s.overflows << ',' << s.peak_bytes << ",\"" << s.device << "\","
        << arguments.label << '\n';
  }
}

void run_bench(const BenchArguments& arguments) {
  if (arguments.frames.size() % 2 != 0)
    throw Error(ErrorCode::invalid_argument, "the frames must be pairs: START END START END ...");
  std::ofstream csv;
  if (!arguments.csv.empty()) {
    csv.open(arguments.csv);
    if (!csv) throw Error(ErrorCode::file, arguments.csv + ": cannot be written");
    csv << "scene,backend,strategy,mode,repetitions";
    for (const Column& column : kTimes)
      csv << ",ms_" << column.name << ",ms_" << column.name << "_p95";
    csv << ",contacts_vf,contacts_ee,hash,tree_tests,front_nodes,group_pairs,candidates,survivors,"
           "double_precision_tests,exact_tests,steals,idle_share,overflows,peak_bytes,device,"
           "label\n";
  } else {
    csv.setstate(std::ios::failbit);
  }
  for (std::size_t i = 0; i + 1 < arguments.frames.size(); i += 2)
    run_scene(arguments, arguments.frames[i], arguments.frames[i + 1], csv);
}

}  // namespace

void add_bench(CLI::App& app) {
  const auto arguments = std::make_shared<BenchArguments>();
  for (const Strategy strategy : kStrategies) arguments->strategies.emplace_back(name(strategy));
  CLI::App* command = app.add_subcommand(
      "bench", "Time whole detections stage by stage, with each backend and strategy");
  command->add_option("FRAMES", arguments->frames, "pairs of PLY files: START END START END ...")
      ->required();
  command->add_option("--backend", arguments->backends, "cpu, cuda or both")
      ->check(CLI::IsMember({"cpu", "cuda"}));
  command->add_option("--strategy", arguments->strategies,
                      "strategies of the cuda backend; default: all");
  command
      ->add_option("--threads", arguments->threads,
                   "number of threads of the cpu backend; 0: as many as there are cores")
      ->check(CLI::Range(0, 1024));
  command->add_option("--repeat", arguments->repeat, "number of timed detections for each row")
      ->check(CLI::Range(1, 100000));
  command->add_option("--csv", arguments->csv, "write medians, 95th percentiles and counts")
      ->type_name("FILE.csv");
  command->add_option("--label", arguments->label,
                      "text for the last column of the CSV, for example a commit");
  command->footer(
      "Times are medians in milliseconds. Column device: from positions in GPU memory to sorted\n"
      "contacts in GPU memory. All rows of a scene must have the same hash; otherwise the bench\n"
      "fails.\n"
      "Example: lazyccd bench 92.ply 93.ply --backend cpu cuda --csv bench.csv");
  command->callback([arguments] { run_bench(*arguments); });
}

}  // namespace lazyccd::program
