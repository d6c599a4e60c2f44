// lazyccd queries: runs the narrow phase by itself.
#include <array>
#include <chrono>
#include <cstdio>
#include <map>
#include <memory>
#include <vector>

#include "cli/commands.h"
#include "cli/stats_json.h"
#include "io/queries.h"
#include "io/results.h"
#include "lazyccd/query.h"

namespace lazyccd::program {

namespace {

struct QueryArguments {
  std::string file;
  ContactKind kind{};
  std::string out, stats;
};

// Counts over all queries of a file.
struct Summary {
  std::size_t queries = 0, rounded = 0, hits = 0;
  bool has_truth = false;
  std::size_t true_hits = 0, missed = 0, false_hits = 0;
  std::array<std::size_t, 3> by_stage{};
  double milliseconds = 0;
};

Summary summarize(const io::QueryFile& file, const std::vector<QueryResult>& results,
                  const std::vector<Stage>& stages, double milliseconds) {
  Summary summary;
  summary.queries = results.size();
  summary.rounded = file.rounded;
  summary.has_truth = !file.truth.empty();
  summary.milliseconds = milliseconds;
  for (std::size_t i = 0; i < results.size(); ++i) {
    ++summary.by_stage[static_cast<std::size_t>(stages[i])];
    summary.hits += results[i].hit;
    if (!summary.has_truth) continue;
    const bool truth = file.truth[i] != 0;
    summary.true_hits += truth;
    summary.missed += truth && !results[i].hit;
    summary.false_hits += !truth && results[i].hit;
  }
  return summary;
}

void print(const Summary& summary) {
  std::printf("%zu queries, %zu hits\n", summary.queries, summary.hits);
  if (summary.rounded > 0) {
    std::printf("note: %zu coordinates were rounded, because no double represents them exactly\n",
                summary.rounded);
  }
  if (summary.has_truth) {
    std::printf("truth: %zu hits; missed %zu, false hits %zu\n", summary.true_hits, summary.missed,
                summary.false_hits);
  }
  std::printf("decided in single precision %zu, in double %zu, exactly %zu\n", summary.by_stage[0],
              summary.by_stage[1], summary.by_stage[2]);
  std::printf("%.3f ms, %.3f us a query\n", summary.milliseconds,
              summary.milliseconds * 1e3 / static_cast<double>(summary.queries));
}

nlohmann::ordered_json to_json(const Summary& summary) {
  nlohmann::ordered_json json = {
      {"queries", summary.queries},
      {"rounded_coordinates", summary.rounded},
      {"hits", summary.hits},
      {"decided",
       {{"single_precision", summary.by_stage[0]},
        {"double_precision", summary.by_stage[1]},
        {"exact", summary.by_stage[2]}}},
      {"milliseconds", summary.milliseconds},
  };
  if (summary.has_truth) {
    json["truth"] = {{"hits", summary.true_hits},
                     {"missed", summary.missed},
                     {"false_hits", summary.false_hits}};
  }
  return json;
}

void run_queries(const QueryArguments& arguments) {
  const io::QueryFile file = io::read_queries(arguments.file);
  std::vector<QueryResult> results(file.points.size());
  std::vector<Stage> stages(file.points.size());
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < results.size(); ++i) {
    results[i] = decide(arguments.kind, file.points[i], &stages[i]);
  }
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;

  const Summary summary = summarize(file, results, stages, time.count());
  if (!arguments.out.empty()) io::write_results_csv(arguments.out, results);
  if (!arguments.stats.empty()) write_json(arguments.stats, to_json(summary));
  print(summary);
}

}  // namespace

void add_queries(CLI::App& app) {
  static const std::map<std::string, ContactKind> kinds = {{"vf", ContactKind::vertex_face},
                                                           {"ee", ContactKind::edge_edge}};
  const auto arguments = std::make_shared<QueryArguments>();
  CLI::App* command = app.add_subcommand("queries", "Decide elementary queries one by one");
  command
      ->add_option(
          "FILE", arguments->file,
          "queries, as .csv or .bin: eight points each, four at the start and four at the end")
      ->required();
  command->add_option("--kind", arguments->kind, "vf (vertex and face) or ee (two edges)")
      ->required()
      ->transform(CLI::CheckedTransformer(kinds).description("{vf,ee}"));
  command
      ->add_option("--out", arguments->out, "write the answers, with columns query_index,hit,toi")
      ->type_name("FILE.csv");
  command->add_option("--stats", arguments->stats, "write counts and times")
      ->type_name("FILE.json");
  command->footer(
      "A .csv has eight rows a query: numerator and denominator of x, y and z, and optionally the\n"
      "truth (0 or 1) as a seventh column. A .bin has int32 n, 24 n float64 and n bytes of truth.\n"
      "If the truth is given, missed hits and false hits are counted.\n"
      "Example: lazyccd queries unit-tests/vertex-face/data_0_0.csv --kind vf --out answers.csv");
  command->callback([arguments] { run_queries(*arguments); });
}

}  // namespace lazyccd::program
