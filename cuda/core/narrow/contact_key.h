// The order of contacts (operator< in contact.h) as the order of integer keys.
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

/// Builds 64-bit keys of contacts for one scene. Call only if fits().
struct ContactKey {
  int body_bits, a_bits, b_bits;

  static ContactKey of(std::size_t bodies, std::size_t vertices, std::size_t edges,
                       std::size_t faces) {
    return {bits_for(bodies), bits_for(vertices > edges ? vertices : edges),
            bits_for(faces > edges ? faces : edges)};
  }

  LAZYCCD_HD int bits() const { return 2 * body_bits + 1 + a_bits + b_bits; }
  LAZYCCD_HD bool fits() const { return bits() <= 64; }

  LAZYCCD_HD std::uint64_t operator()(const Contact& c) const {
    std::uint64_t key = static_cast<std::uint64_t>(c.body_a);
    key = key << body_bits | static_cast<std::uint64_t>(c.body_b);
    key = key << 1 | static_cast<std::uint64_t>(c.kind);
    key = key << a_bits | static_cast<std::uint64_t>(c.primitive_a);
    return key << b_bits | static_cast<std::uint64_t>(c.primitive_b);
  }
};

}  // namespace lazyccd
