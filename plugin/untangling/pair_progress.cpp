#include "untangling/pair_progress.h"

#include <algorithm>

#include "settings.h"
#include "util/disjoint_sets.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void PairProgress::place(std::int32_t body) {
  const int id = id_of(body);
  placed_.insert(id);
  for (auto next = progress_.begin(); next != progress_.end();) {
    const auto entry = next++;
    if (entry->first.first == id || entry->first.second == id) progress_.erase(entry);
  }
}

void PairProgress::finish() {
  placed_.clear();
  for (auto next = progress_.begin(); next != progress_.end();) {
    const auto entry = next++;
    if (!entry->second.given_up) progress_.erase(entry);
  }
}

PairProgress::Groups PairProgress::update(const FoundPairs& found, double seconds,
                                          const std::vector<char>& moves) {
  std::set<IdPair> present;
  for (const auto& [pair, now] : found) {
    Progress& progress = progress_[ids_of(pair)];
    present.insert(ids_of(pair));
    progress.seconds_without += seconds;
    const bool is_shallower = now.depth < settings::untangling::min_progress * progress.last_depth;
    if (now.count < progress.fewest || is_shallower) progress.seconds_without = 0;
    if (is_shallower) progress.last_depth = now.depth;
    progress.fewest = std::min(progress.fewest, now.count);
  }
  // A pair that comes apart and intersects again has made all its progress.
  for (auto& [ids, progress] : progress_) {
    if (present.count(ids) > 0) continue;
    progress.fewest = 0;
    progress.last_depth = 0;
  }
  const auto is_active = [&](const auto& entry) {
    return !progress_.at(ids_of(entry.first)).given_up;
  };
  DisjointSets sets(moves.size());
  for (const auto& entry : found) {
    const auto [a, b] = entry.first;
    if (is_active(entry) && moves[a] && moves[b]) sets.join(a, b);
  }
  const auto group_of = [&](const BodyPair& pair) {
    return sets.find(pair[moves[pair[0]] ? 0 : 1]);
  };
  std::map<std::int32_t, double> seconds_without;  // by group: the least of its pairs
  for (const auto& entry : found) {
    if (!is_active(entry)) continue;
    const double of_pair = progress_.at(ids_of(entry.first)).seconds_without;
    double& least = seconds_without.try_emplace(group_of(entry.first), of_pair).first->second;
    least = std::min(least, of_pair);
  }
  Groups groups;
  for (const auto& entry : found) {
    if (!is_active(entry)) continue;
    const std::int32_t group = group_of(entry.first);
    if (seconds_without.at(group) < settings::untangling::max_seconds_without_progress) {
      groups[entry.first] = group;
    } else {
      progress_.at(ids_of(entry.first)).given_up = true;
    }
  }
  return groups;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
