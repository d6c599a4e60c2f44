#include "detection/contact_reduction.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Words = std::array<std::uint64_t, 3>;  // ConstraintKey::points

// Rounds like std::lround(), but without a function call.
int rounded(double x) { return static_cast<int>(x + std::copysign(0.5, x)); }

// Vertices in ascending order, each with its rounded weight in the last byte. `no_vertex` replaces
// vertices with weight zero, so these come last.
using Points = std::array<std::uint64_t, 4>;
constexpr std::uint64_t no_vertex = ~std::uint64_t{0};

std::uint64_t vertex_of(std::uint64_t point) { return point >> 8; }
int weight_of(std::uint64_t point) { return static_cast<std::int8_t>(point & 0xff); }

// Sorts with a sorting network and selects without branches, because a branch on zero weights is
// unpredictable.
Points weighted_vertices_of(const Contact& contact) {
  const std::array<double, 4> weights = contact.weights();
  Points points;
  for (int i = 0; i < 4; ++i) {
    const int weight = rounded(settings::detection::weight_resolution * weights[i]);
    const auto vertex = static_cast<std::uint64_t>(contact.vertices[i]);
    points[i] = weight == 0 ? no_vertex : vertex << 8 | static_cast<std::uint8_t>(weight);
  }
  const auto compare_exchange = [&points](int i, int j) {
    const std::uint64_t a = points[i], b = points[j];
    points[i] = std::min(a, b);
    points[j] = std::max(a, b);
  };
  compare_exchange(0, 1);
  compare_exchange(2, 3);
  compare_exchange(0, 2);
  compare_exchange(1, 3);
  compare_exchange(1, 2);
  return points;
}

// Packs the key of a contact with at most three weighted vertices into `words`.
void set_key(const Points& points, const Contact& contact, Words& words) {
  // The key must not depend on which side comes first, so the first weight is made positive.
  const int sign = weight_of(points[0]) < 0 ? -1 : 1;
  std::uint64_t vertex[3], weights = 0, normal = 0;
  for (int i = 0; i < 3; ++i) {
    const std::uint64_t point = points[i] == no_vertex ? 0 : points[i];
    vertex[i] = vertex_of(point);
    weights = weights << 8 | static_cast<std::uint8_t>(sign * weight_of(point));
  }
  for (const float component : contact.normal) {
    const int rounded_component =
        sign * rounded(settings::detection::normal_resolution * static_cast<double>(component));
    normal = normal << 16 | static_cast<std::uint16_t>(rounded_component);
  }
  words[0] = vertex[0] << 32 | vertex[1];
  words[1] = vertex[2] << 32 | weights;
  words[2] = normal;
}

std::uint32_t hash_of(const Words& words) {
  const std::uint64_t hash = words[0] * 0x9e3779b97f4a7c15ull ^ words[1] * 0xbf58476d1ce4e5b9ull ^
                             words[2] * 0x94d049bb133111ebull;
  return static_cast<std::uint32_t>(hash ^ hash >> 32);
}

}  // namespace

void make_constraint_key(const Contact& contact, ConstraintKey& key) {
  const Points points = weighted_vertices_of(contact);
  key.kind = points[3] != no_vertex ? ConstraintKey::unique : ConstraintKey::shared;
  if (key.kind != ConstraintKey::shared) return;
  set_key(points, contact, key.points);
  key.hash = hash_of(key.points);
}

void ContactReduction::reduce(std::vector<ReductionEntry>& entries, const Threads& threads) {
  std::size_t lists = 1;
  while (lists < entries.size()) lists *= 2;
  by_hash_.reserve(lists, entries.size());
  by_hash_.empty_first(lists);
  constexpr std::size_t grain = 2048;  // more work than it costs to distribute it
  const auto add = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const ConstraintKey& key = entries[i].key;
      if (key.kind == ConstraintKey::shared)
        by_hash_.add(key.hash & (lists - 1), static_cast<std::int32_t>(i));
    }
  };
  const auto reduce_lists = [&](std::size_t first, std::size_t last) {
    for (std::size_t list = first; list < last; ++list) reduce(list, entries);
  };
  threads.parallel_for(entries.size(), grain, std::cref(add));
  threads.parallel_for(lists, grain, std::cref(reduce_lists));
}

// Moves the contacts to another list, one after the other. It has one contact for each key.
void ContactReduction::reduce(std::size_t list, std::vector<ReductionEntry>& entries) {
  const auto entry_at = [&](std::int32_t index) -> ReductionEntry& {
    return entries[static_cast<std::size_t>(index)];
  };
  std::int32_t kept = ParallelLists::none;
  for (std::int32_t i = by_hash_.first(list), next; i != ParallelLists::none; i = next) {
    next = by_hash_.next(i);
    std::int32_t* same = &kept;
    while (*same != ParallelLists::none && entry_at(*same).key.points != entry_at(i).key.points)
      same = &by_hash_.next(*same);
    if (*same == ParallelLists::none) {
      by_hash_.next(i) = ParallelLists::none;
      *same = i;
      continue;
    }
    const std::int32_t other = *same;
    const bool is_nearer =
        std::make_pair(entry_at(i).gap, i) < std::make_pair(entry_at(other).gap, other);
    if (is_nearer) {
      by_hash_.next(i) = by_hash_.next(other);
      *same = i;
    }
    entry_at(is_nearer ? other : i).key.kind = ConstraintKey::none;
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
