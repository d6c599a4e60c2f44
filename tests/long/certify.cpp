// Decides millions of generated queries and compares each answer with the exact one.
//
//   lazyccd_certify --queries 10000000 --seed 1 --threads 2
//
// A third of the queries come from the degenerate generators. The output is a Markdown table. Exit
// code 1 if an answer was wrong. A wrong query is printed with its generator, kind and number;
// --generator and --number run it alone.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "cpu/narrow/exact.h"
#include "support/generators.h"
#include "support/oracle.h"

namespace lazyccd::test {
namespace {

constexpr double tick = 0x1p-32;

struct Tally {
  std::int64_t queries = 0, hits = 0;
  std::int64_t missed = 0, false_hits = 0;
  std::int64_t late = 0;   // time of impact later than the exact one
  std::int64_t early = 0;  // a tick or more earlier than it
  double worst = 0;        // largest difference of early times, as a fraction of the step
  std::array<std::int64_t, 3> stages{};

  void operator+=(const Tally& other) {
    queries += other.queries;
    hits += other.hits;
    missed += other.missed;
    false_hits += other.false_hits;
    late += other.late;
    early += other.early;
    worst = std::max(worst, other.worst);
    for (std::size_t i = 0; i < stages.size(); ++i) stages[i] += other.stages[i];
  }
  std::int64_t wrong() const { return missed + false_hits + late + early; }
};

struct Settings {
  std::uint64_t queries = 1000000, seed = 1;
  unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  std::string generator;
  std::int64_t number = -1;
  bool exact_only = false;
};

Tally judge(ContactKind kind, const QueryPoints& points, bool exact_only) {
  Stage stage = Stage::exact;
  const QueryResult answer = exact_only ? decide_exact(kind, points) : decide(kind, points, &stage);
  const Truth truth = find_truth(kind, points);
  Tally t;
  t.queries = 1;
  t.hits = truth.hit();
  t.missed = truth.hit() && !answer.hit;
  t.false_hits = !truth.hit() && answer.hit;
  t.stages[static_cast<std::size_t>(stage)] = 1;
  if (truth.hit() && answer.hit) {
    t.late = truth.compare(answer.toi) < 0;
    t.early = truth.compare(answer.toi + tick) >= 0;
    t.worst = truth.minus(answer.toi);
  }
  return t;
}

void print_row(const char* name, const Tally& t) {
  std::printf("| %s | %lld | %lld | %lld | %lld | %lld | %lld | %.3g | %lld | %lld | %lld |\n",
              name, static_cast<long long>(t.queries), static_cast<long long>(t.hits),
              static_cast<long long>(t.missed), static_cast<long long>(t.false_hits),
              static_cast<long long>(t.late), static_cast<long long>(t.early), t.worst,
              static_cast<long long>(t.stages[0]), static_cast<long long>(t.stages[1]),
              static_cast<long long>(t.stages[2]));
}

int certify(const Settings& settings) {
  std::vector<const Generator*> regular, degenerate;
  for (const Generator& g : generators()) {
    std::vector<const Generator*>& sort = g.is_degenerate ? degenerate : regular;
    if (settings.generator.empty() || settings.generator == g.name)
      sort.insert(sort.end(), static_cast<std::size_t>(g.share), &g);
  }
  if (regular.empty()) regular = degenerate;
  if (degenerate.empty()) degenerate = regular;

  std::vector<Tally> total(generators().size());
  std::mutex mutex;
  std::atomic<std::uint64_t> next{0};
  const auto work = [&] {
    constexpr std::uint64_t chunk = 1000;
    for (std::uint64_t first; (first = next.fetch_add(chunk)) < settings.queries;) {
      std::vector<Tally> tallies(total.size());
      for (std::uint64_t i = first; i < std::min(first + chunk, settings.queries); ++i) {
        const std::vector<const Generator*>& from = i % 3 == 0 ? degenerate : regular;
        const std::uint64_t draw = Random(settings.seed ^ (i << 20)).bits();
        const Generator& generator = *from[draw % from.size()];
        const ContactKind kind = static_cast<ContactKind>((draw >> 40) & 1);
        if (settings.number >= 0 && i != static_cast<std::uint64_t>(settings.number)) continue;
        const Tally t =
            judge(kind, generate(generator, kind, settings.seed, i), settings.exact_only);
        tallies[static_cast<std::size_t>(&generator - generators().data())] += t;
        if (t.wrong() > 0)
          std::fprintf(stderr, "wrong: %s, %s, number %llu\n", generator.name,
                       kind == ContactKind::vertex_face ? "vertex-face" : "edge-edge",
                       static_cast<unsigned long long>(i));
      }
      const std::lock_guard<std::mutex> lock(mutex);
      for (std::size_t i = 0; i < total.size(); ++i) total[i] += tallies[i];
    }
  };
  std::vector<std::thread> threads;
  for (unsigned i = 0; i < settings.threads; ++i) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();

  std::printf(
      "| generator | queries | truly hit | missed | false | late | early | worst earliness "
      "| single | double | exact |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  Tally all;
  for (const bool is_degenerate : {false, true}) {
    Tally sum;
    for (std::size_t i = 0; i < total.size(); ++i) {
      if (generators()[i].is_degenerate != is_degenerate || total[i].queries == 0) continue;
      print_row(generators()[i].name, total[i]);
      sum += total[i];
    }
    print_row(is_degenerate ? "**degenerate**" : "**regular**", sum);
    all += sum;
  }
  print_row("**all**", all);
  return all.wrong() > 0;
}

}  // namespace
}  // namespace lazyccd::test

int main(int argc, char** argv) {
  lazyccd::test::Settings settings;
  CLI::App app("Compares the narrow phase with the exact truth on generated queries.");
  app.add_option("--queries", settings.queries, "How many")->capture_default_str();
  app.add_option("--seed", settings.seed, "Of the generators")->capture_default_str();
  app.add_option("--threads", settings.threads, "How many")->capture_default_str();
  app.add_option("--generator", settings.generator, "Only this one");
  app.add_option("--number", settings.number, "Only the query of this number");
  app.add_flag("--exact-only", settings.exact_only, "Run the exact stage alone");
  CLI11_PARSE(app, argc, argv);
  return lazyccd::test::certify(settings);
}
