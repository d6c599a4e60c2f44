// Counts of bits, inlined into the kernels.
#pragma once

#include <cstdint>

#include "simd/inline.h"

#ifndef LAZYCCD_ISA
#error "compile with -DLAZYCCD_ISA=<name>"
#endif

namespace lazyccd {
namespace LAZYCCD_ISA {

/// Number of bits that are set.
LAZYCCD_INLINE int count_bits(std::uint32_t x) {
#if defined(LAZYCCD_PLAIN_CPP)
  x -= x >> 1 & 0x55555555u;
  x = (x & 0x33333333u) + (x >> 2 & 0x33333333u);
  x = (x + (x >> 4)) & 0x0f0f0f0fu;
  return static_cast<int>(x * 0x01010101u >> 24);
#else
  return __builtin_popcount(x);
#endif
}

/// Index of the lowest bit that is set; x is not 0.
LAZYCCD_INLINE int lowest_bit(std::uint32_t x) {
#if defined(LAZYCCD_PLAIN_CPP)
  return count_bits((x & (0 - x)) - 1);
#else
  return __builtin_ctz(x);
#endif
}

}  // namespace LAZYCCD_ISA
}  // namespace lazyccd
