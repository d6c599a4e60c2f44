#include "detection/contact_reduction.h"

#include <algorithm>
#include <cmath>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

using Words = std::array<std::uint64_t, 3>;  // ContactKey::points

constexpr double parts_of_weight = 16, parts_of_normal = 4;

// As std::lround(), which is a call.
int rounded(double x) { return static_cast<int>(x + std::copysign(0.5, x)); }

// Vertices, each with its rounded weight in the last byte, in order; then `none` in place of those
// whose weights are zero.
using Points = std::array<std::uint64_t, 4>;
constexpr std::uint64_t none = ~std::uint64_t{0};

std::uint64_t vertex_of(std::uint64_t point) { return point >> 8; }
int weight_of(std::uint64_t point) { return static_cast<std::int8_t>(point & 0xff); }

// Without branches: which weights are zero, nobody foresees.
Points points_of(const Contact& contact) {
  const std::array<double, 4> weights = contact.weights();
  Points points;
  for (int i = 0; i < 4; ++i) {
    const int weight = rounded(parts_of_weight * weights[i]);
    const auto vertex = static_cast<std::uint64_t>(contact.vertices[i]);
    points[i] = weight == 0 ? none : vertex << 8 | static_cast<std::uint8_t>(weight);
  }
  const auto put_in_order = [&points](int i, int j) {
    const std::uint64_t a = points[i], b = points[j];
    points[i] = std::min(a, b);
    points[j] = std::max(a, b);
  };
  put_in_order(0, 1);
  put_in_order(2, 3);
  put_in_order(0, 2);
  put_in_order(1, 3);
  put_in_order(1, 2);
  return points;
}

// Of at most three points.
void set_key(const Points& points, const Contact& contact, Words& words) {
  // Which of two sides is the first is of no matter.
  const int sign = weight_of(points[0]) < 0 ? -1 : 1;
  std::uint64_t vertex[3], weights = 0, normal = 0;
  for (int i = 0; i < 3; ++i) {
    const std::uint64_t point = points[i] == none ? 0 : points[i];
    vertex[i] = vertex_of(point);
    weights = weights << 8 | static_cast<std::uint8_t>(sign * weight_of(point));
  }
  for (const float component : contact.normal) {
    const int part = sign * rounded(parts_of_normal * static_cast<double>(component));
    normal = normal << 16 | static_cast<std::uint16_t>(part);
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

void make_contact_key(const Contact& contact, ContactKey& key) {
  const Points points = points_of(contact);
  key.kind = points[3] != none ? ContactKey::of_one : ContactKey::of_some;
  if (key.kind != ContactKey::of_some) return;
  set_key(points, contact, key.points);
  key.hash = hash_of(key.points);
}

void ContactReduction::reduce(std::vector<ReductionEntry>& entries) {
  std::size_t slots = 2;
  while (slots < 2 * entries.size()) slots *= 2;
  constexpr std::int32_t free = -1;
  table_.assign(slots, free);
  const auto bond_at = [&](std::int32_t at) -> ReductionEntry& {
    return entries[static_cast<std::size_t>(at)];
  };
  for (std::size_t i = 0; i < entries.size(); ++i) {
    ReductionEntry& entry = entries[i];
    if (entry.key.kind != ContactKey::of_some) continue;
    const Words& words = entry.key.points;
    std::size_t slot = entry.key.hash & (slots - 1);
    while (table_[slot] != free && bond_at(table_[slot]).key.points != words)
      slot = (slot + 1) & (slots - 1);
    const auto at = static_cast<std::int32_t>(i), other = table_[slot];
    // Without a branch: which is nearer, nobody foresees.
    const bool nearer = other == free || entry.gap < bond_at(other).gap;
    table_[slot] = nearer ? at : other;
    if (other != free) bond_at(nearer ? other : at).key.kind = ContactKey::none;
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
