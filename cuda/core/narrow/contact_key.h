// The order of contacts (by world, then operator< of contact.h) as the order of integer keys.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/platform.h"
#include "lazyccd/contact.h"

namespace lazyccd {

/// Returns the number of bits that hold the indices 0 .. count - 1, at most 63.
constexpr int bits_for(std::size_t count) {
  int bits = 0;
  while (bits < 63 && (std::size_t{1} << bits) < count) ++bits;
  return bits;
}

/// The world of a contact: that of its bodies; -1 if both are in every world.
LAZYCCD_HD inline std::int32_t world_of(const Contact& c, const std::int32_t* world_of_body) {
  const std::int32_t a = world_of_body[c.body_a], b = world_of_body[c.body_b];
  return a > b ? a : b;
}

/// Builds the keys of the contacts of one scene: by world, then as operator< of Contact. A key is
/// one 64-bit word, or two if the scene needs more bits.
struct ContactKey {
  int world_bits, body_bits, a_bits, b_bits;
  const std::int32_t* world_of_body;  // null: all bodies are in one world

  /// `worlds`: the number of worlds, not counting -1.
  static ContactKey of(std::size_t worlds, const std::int32_t* world_of_body, std::size_t bodies,
                       std::size_t vertices, std::size_t edges, std::size_t faces) {
    return {world_of_body == nullptr ? 0 : bits_for(worlds + 1), bits_for(bodies),
            bits_for(vertices > edges ? vertices : edges), bits_for(faces > edges ? faces : edges),
            world_of_body};
  }

  LAZYCCD_HD int upper_bits() const { return world_bits + 2 * body_bits; }
  LAZYCCD_HD int lower_bits() const { return 1 + a_bits + b_bits; }  // never more than 64
  LAZYCCD_HD int bits() const { return upper_bits() + lower_bits(); }
  /// Whether operator() gives the whole key.
  LAZYCCD_HD bool is_one_word() const { return bits() <= 64; }
  /// Whether upper() and lower() give the whole key.
  LAZYCCD_HD bool is_two_words() const { return upper_bits() <= 64; }

  LAZYCCD_HD std::uint64_t upper(const Contact& c) const {
    std::uint64_t key = 0;
    if (world_of_body != nullptr)
      key = static_cast<std::uint64_t>(std::int64_t{world_of(c, world_of_body)} + 1);
    key = key << body_bits | static_cast<std::uint64_t>(c.body_a);
    return key << body_bits | static_cast<std::uint64_t>(c.body_b);
  }
  LAZYCCD_HD std::uint64_t lower(const Contact& c) const {
    std::uint64_t key = static_cast<std::uint64_t>(c.kind);
    key = key << a_bits | static_cast<std::uint64_t>(c.primitive_a);
    return key << b_bits | static_cast<std::uint64_t>(c.primitive_b);
  }
  /// The whole key if it is one word, otherwise its lower word.
  LAZYCCD_HD std::uint64_t operator()(const Contact& c) const {
    return is_one_word() ? upper(c) << lower_bits() | lower(c) : lower(c);
  }
};

/// The order in which contacts are reported: by world, then by operator< of Contact.
struct ContactOrder {
  const std::int32_t* world_of_body;  // null: all bodies are in one world

  bool operator()(const Contact& x, const Contact& y) const {
    if (world_of_body != nullptr) {
      const std::int32_t a = world_of(x, world_of_body), b = world_of(y, world_of_body);
      if (a != b) return a < b;
    }
    return x < y;
  }
};

}  // namespace lazyccd
