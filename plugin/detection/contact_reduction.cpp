#include "detection/contact_reduction.h"

#include <algorithm>
#include <cmath>

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

void ContactReduction::reduce(std::vector<ReductionEntry>& entries) {
  std::size_t slots = 2;
  while (slots < 2 * entries.size()) slots *= 2;
  constexpr std::int32_t empty_slot = -1;
  table_.assign(slots, empty_slot);
  const auto entry_at = [&](std::int32_t index) -> ReductionEntry& {
    return entries[static_cast<std::size_t>(index)];
  };
  for (std::size_t i = 0; i < entries.size(); ++i) {
    ReductionEntry& entry = entries[i];
    if (entry.key.kind != ConstraintKey::shared) continue;
    const Words& words = entry.key.points;
    std::size_t slot = entry.key.hash & (slots - 1);
    while (table_[slot] != empty_slot && entry_at(table_[slot]).key.points != words)
      slot = (slot + 1) & (slots - 1);
    const auto index = static_cast<std::int32_t>(i), other = table_[slot];
    // Selects without a branch: which contact is nearer is unpredictable.
    const bool is_nearer = other == empty_slot || entry.gap < entry_at(other).gap;
    table_[slot] = is_nearer ? index : other;
    if (other != empty_slot) entry_at(is_nearer ? other : index).key.kind = ConstraintKey::none;
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
