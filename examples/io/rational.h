// Converts rational numbers in text to doubles.
#pragma once

#include <string_view>

namespace lazyccd::io {

struct RoundedRational {
  double value;
  bool exact;  // `value` equals the rational number
};

enum class RationalError { none, not_a_number, zero_denominator, out_of_range };

/// Finds the double nearest to numerator / denominator (ties to even) and whether the two are
/// equal. Both are decimal integers of at most 2000 digits.
RationalError to_double(std::string_view numerator, std::string_view denominator,
                        RoundedRational& result);

}  // namespace lazyccd::io
