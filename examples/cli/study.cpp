// lazyccd study: runs generated models through their motion with every combination of settings.
#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "cli/commands.h"
#include "cli/stats_json.h"
#include "lazyccd/detector.h"
#include "lazyccd/error.h"
#include "models/model.h"

namespace lazyccd::program {

namespace {

struct StudyArguments {
  std::vector<std::string> models, backends{"cpu"}, strategies, fronts{"auto"}, volumes{"box"},
      culling{"default"};
  std::vector<int> threads{0}, blocks{0}, block_sizes{0}, chunks{0}, stacks{0};
  std::vector<int> front_periods{DetectorOptions{}.algorithm.front_period};
  std::vector<double> front_ratios{DetectorOptions{}.algorithm.front_ratio};
  int first = 0, last = models::Model::frames - 1, warm_up = 1, repeat = 1;
  std::uint64_t seed = 1;
  bool stages = false;
  std::string csv, steps_csv, label;
};

struct StudySetting {
  std::string backend, front, culling;
  DetectorOptions options;
};

struct Column {
  const char* name;
  std::function<double(const Stats&)> value;
};

double count(std::int64_t n) { return static_cast<double>(n); }

const Column kColumns[] = {
    {"ms_total", [](const Stats& s) { return s.ms_total; }},
    {"ms_device", [](const Stats& s) { return s.ms_device; }},
    {"ms_refit", [](const Stats& s) { return s.ms_refit; }},
    {"ms_front", [](const Stats& s) { return s.ms_front; }},
    {"ms_traverse", [](const Stats& s) { return s.ms_traverse; }},
    {"ms_balance", [](const Stats& s) { return s.ms_balance; }},
    {"ms_leaf", [](const Stats& s) { return s.ms_leaf; }},
    {"ms_narrow", [](const Stats& s) { return s.ms_narrow; }},
    {"ms_sort", [](const Stats& s) { return s.ms_sort; }},
    {"tree_tests", [](const Stats& s) { return count(s.tree_tests); }},
    {"front_start", [](const Stats& s) { return count(s.front_start); }},
    {"front_nodes", [](const Stats& s) { return count(s.front_nodes); }},
    {"front_reused", [](const Stats& s) { return s.front_reused ? 1.0 : 0.0; }},
    {"culled_by_volume", [](const Stats& s) { return count(s.culled_by_volume); }},
    {"group_pairs", [](const Stats& s) { return count(s.group_pairs); }},
    {"culled_by_normal_cone", [](const Stats& s) { return count(s.culled_by_normal_cone); }},
    {"candidates", [](const Stats& s) { return count(s.candidates_vf + s.candidates_ee); }},
    {"orphan_tests", [](const Stats& s) { return count(s.orphan_tests); }},
    {"filtered_noncoplanar", [](const Stats& s) { return count(s.filtered_noncoplanar); }},
    {"survivors", [](const Stats& s) { return count(s.survivors_vf + s.survivors_ee); }},
    {"contacts", [](const Stats& s) { return count(s.contacts_vf + s.contacts_ee); }},
    {"steals", [](const Stats& s) { return count(s.steals); }},
    {"balancings", [](const Stats& s) { return count(s.balancings); }},
    {"overflows", [](const Stats& s) { return count(s.overflows); }},
    {"rebuilt", [](const Stats& s) { return s.rebuilt ? 1.0 : 0.0; }},
    {"idle_share", [](const Stats& s) { return s.idle_share; }},
    {"peak_bytes", [](const Stats& s) { return count(s.peak_bytes); }},
};

Culling parse_culling(const std::string& text) {
  if (text == "default") return {};
  Culling culling{false, false, false};
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, '+');) {
    if (part == "non_penetration") {
      culling.non_penetration = true;
    } else if (part == "normal_cones") {
      culling.normal_cones = true;
    } else if (part == "orphan_sets") {
      culling.orphan_sets = true;
    } else if (part != "none") {
      throw Error(
          ErrorCode::invalid_argument,
          "there is no culling '" + part +
              "'; possible are default, none, and sums of non_penetration, normal_cones and "
              "orphan_sets");
    }
  }
  return culling;
}

FrontUse parse_front(const std::string& text) {
  return text == "on" ? FrontUse::on : text == "off" ? FrontUse::off : FrontUse::automatic;
}

// Replaces `settings` by all combinations of a setting and a value.
template <class Value, class Apply>
void multiply(std::vector<StudySetting>& settings, const std::vector<Value>& values,
              Apply&& apply) {
  std::vector<StudySetting> product;
  for (const StudySetting& setting : settings) {
    for (const Value& value : values) {
      product.push_back(setting);
      apply(product.back(), value);
    }
  }
  settings = std::move(product);
}

// Returns all combinations of settings. Options that a backend does not use are not varied for it.
std::vector<StudySetting> study_settings(const StudyArguments& a) {
  std::vector<StudySetting> all;
  for (const std::string& backend : a.backends) {
    const bool cpu = backend == "cpu";
    std::vector<std::string> strategies = a.strategies;
    if (strategies.empty())
      for (const Strategy s : kStrategies) strategies.emplace_back(name(s));
    std::vector<StudySetting> combinations{{backend, "auto", "default", {}}};
    combinations[0].options.backend = cpu ? Backend::cpu : Backend::cuda;
    combinations[0].options.algorithm.tuning.graph = !a.stages;
    multiply(combinations, strategies, [](StudySetting& s, const std::string& x) {
      s.options.algorithm.strategy = parse_strategy(x);
    });
    multiply(combinations, a.fronts, [](StudySetting& s, const std::string& x) {
      s.front = x;
      s.options.algorithm.front = parse_front(x);
    });
    multiply(combinations, a.front_periods,
             [](StudySetting& s, int x) { s.options.algorithm.front_period = x; });
    multiply(combinations, a.front_ratios,
             [](StudySetting& s, double x) { s.options.algorithm.front_ratio = x; });
    multiply(combinations, a.volumes, [](StudySetting& s, const std::string& x) {
      s.options.algorithm.volume = parse_volume(x);
    });
    multiply(combinations, a.culling, [](StudySetting& s, const std::string& x) {
      s.culling = x;
      s.options.algorithm.culling = parse_culling(x);
    });
    if (cpu) {
      multiply(combinations, a.threads, [](StudySetting& s, int x) { s.options.threads = x; });
    } else {
      multiply(combinations, a.blocks,
               [](StudySetting& s, int x) { s.options.algorithm.tuning.blocks = x; });
      multiply(combinations, a.block_sizes,
               [](StudySetting& s, int x) { s.options.algorithm.tuning.block_size = x; });
    }
    multiply(combinations, a.chunks,
             [](StudySetting& s, int x) { s.options.algorithm.tuning.chunk = x; });
    multiply(combinations, a.stacks,
             [](StudySetting& s, int x) { s.options.algorithm.tuning.stack = x; });
    all.insert(all.end(), combinations.begin(), combinations.end());
  }
  return all;
}

std::string describe(const StudySetting& s, const Stats& stats) {
  std::ostringstream text;
  const Tuning& t = s.options.algorithm.tuning;
  text << s.backend << ',' << '"' << stats.device << '"' << ','
       << name(s.options.algorithm.strategy) << ',' << stats.threads << ',' << t.blocks << ','
       << t.block_size << ',' << t.chunk << ',' << t.stack << ',' << s.front << ','
       << s.options.algorithm.front_period << ',' << s.options.algorithm.front_ratio << ','
       << name(s.options.algorithm.volume) << ',' << s.culling;
  return text.str();
}
constexpr char kSettingColumns[] =
    "backend,device,strategy,threads,blocks,block_size,chunk,stack,front,front_period,front_ratio,"
    "volume,culling";

double percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

std::ofstream open(const std::string& name, const std::string& heading) {
  std::ofstream file;
  if (name.empty()) {
    file.setstate(std::ios::failbit);
    return file;
  }
  file.open(name);
  if (!file) throw Error(ErrorCode::file, name + ": cannot be written");
  file << heading << '\n';
  return file;
}

class Study {
 public:
  explicit Study(const StudyArguments& a) : arguments_(a), settings_(study_settings(a)) {
    std::string columns;
    for (const Column& c : kColumns) columns += std::string(",") + c.name;
    summary_ = open(a.csv, std::string("model,triangles,") + kSettingColumns +
                               ",steps,ms_total_p95" + columns + ",hash,label");
    steps_ = open(a.steps_csv, std::string("model,") + kSettingColumns + ",step" + columns);
  }

  void run(const std::string& name) {
    const auto model = models::make_model(name, arguments_.seed);
    std::vector<std::vector<float>> frames;
    for (int f = arguments_.first; f <= arguments_.last; ++f) frames.push_back(model->frame(f));
    std::printf("\n%s: %zu triangles, %zu steps\n", name.c_str(), model->faces().size(),
                frames.size() - 1);
    std::printf("%-5s %-21s%8s%7s%9s%10s%9s%9s%9s%9s%11s%9s%8s%7s  hash\n", "", "strategy",
                "threads", "blocks", "total", "traverse", "balance", "narrow", "device", "refit",
                "front", "contacts", "steals", "idle");
    bool first = true;
    std::uint64_t expected = 0;
    for (const StudySetting& setting : settings_) {
      const std::uint64_t hash = run(name, *model, frames, setting);
      if (first) expected = hash;
      first = false;
      if (hash != expected)
        throw Error(ErrorCode::device, "the contacts of " + name + " differ: " + setting.backend +
                                           " " + lazyccd::name(setting.options.algorithm.strategy));
    }
  }

 private:
  std::uint64_t run(const std::string& model_name, const models::Model& model,
                    const std::vector<std::vector<float>>& frames, const StudySetting& setting) {
    Detector detector(setting.options);
    detector.set_topology(model.topology());
    const std::size_t vertices = model.vertex_count();
    std::vector<double> sums(std::size(kColumns)), totals;
    std::uint64_t hash = 0;
    for (int round = 0; round < arguments_.repeat; ++round) {
      for (std::size_t f = 0; f + 1 < frames.size(); ++f) {
        detector.detect({frames[f].data(), vertices}, {frames[f + 1].data(), vertices});
        const Stats& s = detector.stats();
        if (s.backend != setting.backend) throw Error(ErrorCode::unavailable, detector.status());
        if (round == 0) hash = 3 * hash + s.hash;  // depends on the order of the steps
        if (round == 0 && static_cast<int>(f) < arguments_.warm_up) continue;
        totals.push_back(s.ms_total);
        for (std::size_t c = 0; c < sums.size(); ++c) sums[c] += kColumns[c].value(s);
        if (round == 0 && steps_) {
          steps_ << model_name << ',' << describe(setting, s) << ','
                 << arguments_.first + static_cast<int>(f);
          for (const Column& c : kColumns) steps_ << ',' << c.value(s);
          steps_ << '\n';
        }
      }
    }
    const Stats& s = detector.stats();
    const double steps = static_cast<double>(totals.size());
    const auto mean = [&](const char* column) {
      const auto at = std::find_if(std::begin(kColumns), std::end(kColumns),
                                   [&](const Column& c) { return std::string(c.name) == column; });
      return sums[static_cast<std::size_t>(at - std::begin(kColumns))] / steps;
    };
    std::printf("%-5s %-21s%8d%7d%9.3f%10.3f%9.3f%9.3f%9.3f%9.3f%11.0f%9.0f%8.0f%7.2f  %s\n",
                setting.backend.c_str(), name(setting.options.algorithm.strategy), s.threads,
                setting.options.algorithm.tuning.blocks, mean("ms_total"), mean("ms_traverse"),
                mean("ms_balance"), mean("ms_narrow"), mean("ms_device"), mean("ms_refit"),
                mean("front_nodes"), mean("contacts"), mean("steals"), mean("idle_share"),
                hash_text(hash).c_str());
    std::fflush(stdout);
    if (summary_) {
      summary_ << model_name << ',' << model.faces().size() << ',' << describe(setting, s) << ','
               << totals.size() << ',' << percentile(totals, 0.95);
      for (const double sum : sums) summary_ << ',' << sum / steps;
      summary_ << ',' << hash_text(hash) << ',' << arguments_.label << std::endl;
    }
    return hash;
  }

  const StudyArguments& arguments_;
  std::vector<StudySetting> settings_;
  std::ofstream summary_, steps_;
};

void run_study(const StudyArguments& arguments) {
  if (arguments.last - arguments.first <= arguments.warm_up)
    throw Error(ErrorCode::invalid_argument, "no step is left after the warm-up");
  Study study(arguments);
  std::vector<std::string> names = arguments.models;
  if (names.empty())
    for (const models::ModelName& m : models::model_names()) names.emplace_back(m.name);
  for (const std::string& name : names) study.run(name);
}

}  // namespace

void add_study(CLI::App& app) {
  const auto arguments = std::make_shared<StudyArguments>();
  StudyArguments& a = *arguments;
  CLI::App* command = app.add_subcommand(
      "study", "Run generated models through their motion with every combination of settings");
  command->add_option("--model", a.models, "names from `lazyccd models`; default: all");
  command->add_option("--seed", a.seed, "seed of the generators");
  command->add_option("--first", a.first, "first frame")
      ->check(CLI::Range(0, models::Model::frames - 2));
  command->add_option("--last", a.last, "last frame")
      ->check(CLI::Range(1, models::Model::frames - 1));
  command->add_option("--warm-up", a.warm_up, "number of first steps that are not counted")
      ->check(CLI::Range(0, models::Model::frames - 2));
  command->add_option("--repeat", a.repeat, "number of passes through the motion")
      ->check(CLI::Range(1, 1000));
  command->add_option("--backend", a.backends, "cpu, cuda or both")
      ->check(CLI::IsMember({"cpu", "cuda"}));
  command->add_option("--strategy", a.strategies, "strategies; default: all of the backend");
  command->add_option("--front", a.fronts, "start from the front of the last step: auto, on or off")
      ->check(CLI::IsMember({"auto", "on", "off"}));
  command
      ->add_option("--front-period", a.front_periods,
                   "number of steps over which the growth of a front is measured (p)")
      ->check(CLI::Range(1, 1000));
  command
      ->add_option("--front-ratio", a.front_ratios,
                   "a front that grows by less than this factor is remade from the root (rt)")
      ->check(CLI::PositiveNumber);
  command->add_option("--volume", a.volumes,
                      "bounding volume of the tree's nodes: box, dop18 or oriented_box");
  command->add_option("--culling", a.culling,
                      "default, none, or a sum such as "
                      "non_penetration+normal_cones+orphan_sets");
  command
      ->add_option("--threads", a.threads,
                   "number of threads of the cpu backend; 0: as many as there are cores")
      ->check(CLI::Range(0, 1024));
  command
      ->add_option("--blocks", a.blocks,
                   "number of blocks of the cuda traversal; 0: as many as fit")
      ->check(CLI::Range(0, 100000));
  command
      ->add_option("--block-size", a.block_sizes,
                   "threads in each block of the cuda traversal; 0: the default")
      ->check(CLI::Range(0, 512));
  command
      ->add_option("--chunk", a.chunks, "number of pairs that change hands at once; 0: the default")
      ->check(CLI::Range(0, 256));
  command->add_option("--stack", a.stacks, "size of a worker's own stack, in pairs; 0: the default")
      ->check(CLI::Range(0, 1 << 20));
  command->add_flag("--stages", a.stages, "cuda: time each stage by itself, without a CUDA graph");
  command
      ->add_option("--csv", a.csv,
                   "write one row for each model and setting, with means over the steps")
      ->type_name("FILE.csv");
  command->add_option("--steps-csv", a.steps_csv, "write one row for each step")
      ->type_name("FILE.csv");
  command->add_option("--label", a.label,
                      "text for the last column of the CSV, for example a commit");
  command->footer(
      "If an option has several values, each is tried in turn. Times are means in milliseconds.\n"
      "All rows of a model must have the same hash; otherwise the study fails.\n"
      "Example: lazyccd study --model funnel --threads 1 2 --csv study.csv");
  command->callback([arguments] { run_study(*arguments); });
}

}  // namespace lazyccd::program
