#include "distinct_contacts.h"

#include <array>
#include <cstdint>
#include <utility>

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Points, then the rounded normal.
using Key = std::array<std::uint64_t, 5>;

constexpr double parts_of_weight = 16, parts_of_normal = 4;

// As std::lround(), which is a call.
int rounded(double x) { return static_cast<int>(x < 0 ? x - 0.5 : x + 0.5); }

// Vertices with their rounded weights, in order, where these are not zero.
struct Points {
  std::array<std::pair<std::int32_t, int>, 4> at;
  int count = 0;
};

Points points_of(const Contact& contact) {
  const std::array<double, 4> weights = contact.weights();
  Points points;
  for (int i = 0; i < 4; ++i) {
    const int weight = rounded(parts_of_weight * weights[i]);
    if (weight == 0) continue;
    int at = points.count++;
    for (; at > 0 && contact.vertices[i] < points.at[at - 1].first; --at)
      points.at[at] = points.at[at - 1];
    points.at[at] = {contact.vertices[i], weight};
  }
  return points;
}

Key key_of(const Points& points, const Contact& contact) {
  // Which of two sides is the first is of no matter.
  const int sign = points.at[0].second < 0 ? -1 : 1;
  Key key{};
  for (int i = 0; i < points.count; ++i) {
    key[i] = static_cast<std::uint64_t>(points.at[i].first) << 32 |
             static_cast<std::uint32_t>(sign * points.at[i].second);
  }
  for (const float component : contact.normal) {
    const int part = sign * rounded(parts_of_normal * static_cast<double>(component));
    key[4] = key[4] << 16 | static_cast<std::uint16_t>(part);
  }
  return key;
}

std::size_t hash_of(const Key& key) {
  std::uint64_t hash = 0;
  for (const std::uint64_t part : key) hash = (hash ^ part ^ part >> 29) * 0x9e3779b97f4a7c15ull;
  return static_cast<std::size_t>(hash ^ hash >> 32);
}

}  // namespace

void keep_distinct(std::vector<Contact>& contacts, const std::vector<double>& gaps) {
  std::size_t slots = 2;
  while (slots < 2 * contacts.size()) slots *= 2;
  constexpr std::int32_t free = -1;
  std::vector<std::int32_t> table(slots, free);  // indices into keys
  std::vector<Key> keys;
  std::vector<std::size_t> nearest;  // by key
  std::vector<char> kept(contacts.size(), 0);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Points points = points_of(contacts[i]);
    // What all four vertices bear, no other pair of primitives binds.
    if (points.count == 4) {
      kept[i] = 1;
      continue;
    }
    const Key key = key_of(points, contacts[i]);
    std::size_t slot = hash_of(key) & (slots - 1);
    while (table[slot] != free && keys[static_cast<std::size_t>(table[slot])] != key)
      slot = (slot + 1) & (slots - 1);
    if (table[slot] == free) {
      table[slot] = static_cast<std::int32_t>(keys.size());
      keys.push_back(key);
      nearest.push_back(i);
    } else if (std::size_t& other = nearest[static_cast<std::size_t>(table[slot])];
               gaps[i] < gaps[other]) {
      other = i;
    }
  }
  for (const std::size_t i : nearest) kept[i] = 1;
  std::size_t count = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (kept[i]) contacts[count++] = contacts[i];
  contacts.resize(count);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
