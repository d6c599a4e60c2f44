// The program lazyccd_chart: measures speed and accuracy of every elementary test. Prints a table
// and writes a CSV file, from which examples/bench/accuracy/chart.sh draws pictures.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "bench/accuracy/generated_sets.h"
#include "bench/accuracy/score.h"
#include "bench/frames.h"
#include "bench/machine.h"

namespace {

using namespace lazyccd;
using namespace lazyccd::bench;

// The pool of queries as a detector meets them in practice.
constexpr const char* broad_phase = "broad phase";

// Appends pools to the scores of single sets: one of the sets that were sampled from a broad phase
// (bp-*) and one of all sets, for each kind and for both kinds together.
std::vector<Score> with_pools(std::vector<Score> scores) {
  struct Pool {
    const char* name;
    std::string prefix;
  };
  const std::vector<Pool> pools{{broad_phase, "bp-"}, {"all sets", ""}};
  std::vector<Score> sums;
  for (const Pool& pool : pools)
    for (const std::string kind : {"vf", "ee", "both"}) {
      std::vector<std::vector<const Score*>> by_method;
      for (const Score& s : scores) {
        if (s.set.rfind(pool.prefix, 0) != 0 || (kind != "both" && s.kind != kind)) continue;
        const auto same = std::find_if(by_method.begin(), by_method.end(), [&](const auto& group) {
          return group[0]->method == s.method && group[0]->precision == s.precision;
        });
        if (same == by_method.end())
          by_method.push_back({&s});
        else
          same->push_back(&s);
      }
      for (const auto& group : by_method) sums.push_back(pooled(pool.name, kind, group));
    }
  scores.insert(scores.end(), sums.begin(), sums.end());
  return scores;
}

void write_csv(const std::string& path, const std::vector<Score>& scores) {
  std::ofstream out(path);
  out << "set,kind,method,precision,queries,decided,truly_touching,missed,false_hits,ns_per_query,"
         "timed,toi_early_median,toi_early_largest,toi_late,rounds,machine\n";
  for (const Score& s : scores) {
    out << '"' << s.set << "\"," << s.kind << ",\"" << s.method << "\"," << s.precision << ','
        << s.queries << ',' << s.decided << ',' << s.truly_touching << ',' << s.missed << ','
        << s.false_hits << ',' << s.nanoseconds << ',' << s.early.size() << ',';
    if (s.early.empty())
      out << ",,";
    else
      out << median(s.early) << ',' << *std::max_element(s.early.begin(), s.early.end()) << ','
          << s.late;
    out << ',' << s.rounds << ",\"" << machine() << "\"\n";
  }
}

void print_pool(const std::string& name, const std::string& kind,
                const std::vector<Score>& scores) {
  bool first = true;
  for (const Score& s : scores) {
    if (s.set != name || s.kind != kind) continue;
    if (first)
      std::printf("\n%s, %s: %zu queries, %zu truly touch\n  %-26s %-12s %7s %7s %12s %11s %6s\n",
                  name.c_str(), kind == "both" ? "vertex-face and edge-edge" : "vertex-face",
                  s.queries, s.truly_touching, "method", "precision", "missed", "false",
                  "ns a query", "toi early", "late");
    first = false;
    std::printf("  %-26s %-12s %7zu %7zu %12.1f", s.method.c_str(), s.precision.c_str(), s.missed,
                s.false_hits, s.nanoseconds);
    if (!s.early.empty()) std::printf(" %11.2g %6zu", median(s.early), s.late);
    if (s.decided < s.queries) std::printf("  (%zu decided)", s.decided);
    std::printf("\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Speed and accuracy of every elementary test on all sets of queries.\n"
      "Example: lazyccd_chart --csv queries.csv"};
  std::string data = default_data_dir().string(), csv;
  int generated = 500;
  Budget budget;
  app.add_option("--data", data, "data folder, which contains queries/; may be missing")
      ->capture_default_str();
  app.add_option("--generated", generated,
                 "number of generated queries of each kind, for degenerate and other ones")
      ->capture_default_str();
  app.add_option("--rounds", budget.rounds, "number of rounds for the medians")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--seconds", budget.seconds,
                 "time limit for one method on one set; the remaining queries stay undecided")
      ->capture_default_str();
  app.add_option("--csv", csv, "also write every set and pool to this file");
  CLI11_PARSE(app, argc, argv);

  try {
    std::vector<QuerySet> sets = read_query_sets(data);
    if (sets.empty()) std::cout << "no queries in " << data << "; using generated queries only\n";
    for (QuerySet& set : generated_query_sets(generated, 1)) sets.push_back(std::move(set));
    const std::vector<peers::Method> methods = peers::all_methods();
    std::vector<Score> scores;
    for (const QuerySet& set : sets) {
      std::fprintf(stderr, "%s %s\n", set.name.c_str(),
                   set.kind == ContactKind::vertex_face ? "vf" : "ee");
      for (Score& score : measure(set, methods, budget)) scores.push_back(std::move(score));
    }
    scores = with_pools(std::move(scores));
    std::cout << machine() << ", one thread, medians of " << budget.rounds << " rounds\n";
    for (const char* pool : {broad_phase, "all sets"})
      for (const char* kind : {"both", "vf"}) print_pool(pool, kind, scores);
    if (!csv.empty()) write_csv(csv, scores);
  } catch (const std::exception& error) {
    std::cerr << "lazyccd_chart: " << error.what() << "\n";
    return 1;
  }
}
