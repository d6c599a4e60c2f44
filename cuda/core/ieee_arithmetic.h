// The arithmetic that the certified tests assume: IEEE 754 in the declared precision, rounding to
// nearest, denormals kept, no contraction. Applications change the mode of their threads; games
// often flush denormals to zero.
#pragma once

#include <cfenv>
#include <cfloat>
#include <cstdint>

#if defined(__SSE2__) || defined(_M_X64)
#define LAZYCCD_MXCSR
#include <immintrin.h>
#endif

#include "core/platform.h"

// The x87 unit rounds twice.
static_assert(FLT_EVAL_METHOD == 0, "compile for SSE2 or later: float must be computed in float");

namespace lazyccd {

/// Gives this thread IEEE arithmetic until the end of the scope. Costs a few nanoseconds; the mode
/// is written only if it differs. Flags of exceptions that are raised in the scope are lost on x86
/// if the mode was wrong.
class IeeeArithmetic {
 public:
  IeeeArithmetic() : mode_(mode()) {
    if (mode_ != corrected(mode_)) set_mode(corrected(mode_));
  }
  ~IeeeArithmetic() {
    if (mode_ != corrected(mode_)) set_mode(mode_);
  }
  IeeeArithmetic(const IeeeArithmetic&) = delete;
  IeeeArithmetic& operator=(const IeeeArithmetic&) = delete;

 private:
#if defined(LAZYCCD_MXCSR)
  using Mode = unsigned;
  // Flush to zero, denormals are zero, rounding control.
  static constexpr Mode kWrong = 0x8000 | 0x0040 | 0x6000;
  // Exceptions are masked: 0 / 0 and the like occur in lanes that are not used.
  static constexpr Mode kNeeded = 0x1f80;
  static Mode mode() { return _mm_getcsr(); }
  static void set_mode(Mode mode) { _mm_setcsr(mode); }
#elif defined(__aarch64__) && (defined(__GNUC__) || defined(__clang__))
  using Mode = std::uint64_t;
  // FZ, RMode, AH and FIZ of the register FPCR, and its traps of exceptions.
  static constexpr Mode kWrong = 1u << 24 | 3u << 22 | 3u | 0x9f00;
  static constexpr Mode kNeeded = 0;
  static Mode mode() {
    Mode mode;
    asm volatile("mrs %0, fpcr" : "=r"(mode));
    return mode;
  }
  static void set_mode(Mode mode) { asm volatile("msr fpcr, %0" : : "r"(mode)); }
#else
  using Mode = int;
  // 0 is rounding to nearest; no more is known of other processors.
  static constexpr Mode kWrong = ~0, kNeeded = 0;
  static Mode mode() { return std::fegetround() ^ FE_TONEAREST; }
  static void set_mode(Mode mode) { std::fesetround(mode ^ FE_TONEAREST); }
#endif
  static Mode corrected(Mode mode) { return (mode & ~kWrong) | kNeeded; }

  Mode mode_;
};

/// Returns whether products are rounded before they are added, which is a matter of compiler flags,
/// and whether this thread has the mode of IeeeArithmetic.
bool has_ieee_arithmetic();

}  // namespace lazyccd
