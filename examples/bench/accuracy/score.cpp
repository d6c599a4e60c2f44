#include "bench/accuracy/score.h"

#include <algorithm>
#include <limits>

#include "bench/machine.h"

namespace lazyccd::bench {
namespace {

// The true times are rounded to the nearest double.
constexpr double truth_rounding = std::numeric_limits<double>::epsilon();

// Block b of n has the queries b, b + n, b + 2n, ... So a measurement that stops early has covered
// all parts of a set.
struct Block {
  std::vector<std::size_t> index;
  std::vector<QueryPoints> queries;
};

std::vector<Block> blocks(const QuerySet& set) {
  constexpr std::size_t block_size = 128;
  std::vector<Block> all((set.queries.size() + block_size - 1) / block_size);
  for (std::size_t i = 0; i < set.queries.size(); ++i) {
    Block& block = all[i % all.size()];
    block.index.push_back(i);
    block.queries.push_back(set.queries[i]);
  }
  return all;
}

// Adds the comparison of a block's answers with the truth to a score.
void compare(const QuerySet& set, const Block& block, const std::vector<QueryResult>& answers,
             Score& score) {
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const std::size_t q = block.index[i];
    score.truly_touching += set.hit[q];
    score.missed += set.hit[q] && !answers[i].hit;
    score.false_hits += !set.hit[q] && answers[i].hit;
    if (!score.gives_time || set.toi.empty() || !set.hit[q] || !answers[i].hit) continue;
    score.early.push_back(set.toi[q] - answers[i].toi);
    score.late += score.early.back() < -truth_rounding;
  }
}

}  // namespace

std::vector<Score> measure(const QuerySet& set, const std::vector<peers::Method>& methods,
                           const Budget& budget) {
  struct Run {
    const peers::Method* method;
    Score score;
    double seconds = 0;
    std::vector<double> means = {};
  };
  const bool vf = set.kind == ContactKind::vertex_face;
  std::vector<Run> runs;
  for (const peers::Method& m : methods) {
    if (m.vertex_face_only && !vf) continue;
    runs.push_back({&m, {set.name, vf ? "vf" : "ee", m.name, m.precision, set.queries.size()}});
    runs.back().score.gives_time = m.gives_time;
  }
  const std::vector<Block> all = blocks(set);
  std::vector<QueryResult> answers;
  for (int round = 0; round < budget.rounds; ++round) {
    for (Run& run : runs) {
      if (run.seconds > budget.seconds) continue;
      double nanoseconds = 0;
      std::size_t decided = 0;
      for (const Block& block : all) {
        answers.resize(block.queries.size());
        const double took = run.method->solve(set.kind, block.queries, answers);
        nanoseconds += took;
        run.seconds += took * 1e-9;
        decided += answers.size();
        if (round == 0) compare(set, block, answers, run.score);
        if (run.seconds > budget.seconds) break;
      }
      if (round == 0) run.score.decided = decided;
      if (decided == run.score.decided) run.means.push_back(nanoseconds / double(decided));
    }
  }
  std::vector<Score> scores;
  for (Run& run : runs) {
    run.score.rounds = int(run.means.size());
    run.score.nanoseconds = median(run.means);
    scores.push_back(std::move(run.score));
  }
  return scores;
}

Score pooled(std::string name, std::string kind, const std::vector<const Score*>& parts) {
  Score sum{std::move(name), std::move(kind), parts[0]->method, parts[0]->precision};
  sum.gives_time = parts[0]->gives_time;
  sum.rounds = parts[0]->rounds;
  for (const Score* part : parts) {
    sum.queries += part->queries;
    sum.decided += part->decided;
    sum.truly_touching += part->truly_touching;
    sum.missed += part->missed;
    sum.false_hits += part->false_hits;
    sum.late += part->late;
    sum.early.insert(sum.early.end(), part->early.begin(), part->early.end());
    sum.rounds = std::min(sum.rounds, part->rounds);
    sum.nanoseconds += part->nanoseconds * double(part->queries);
  }
  sum.nanoseconds /= double(sum.queries);
  return sum;
}

}  // namespace lazyccd::bench
