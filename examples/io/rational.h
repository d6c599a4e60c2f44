// Rational numbers in text, as doubles.
#pragma once

#include <string_view>

namespace lazyccd::io {

struct RoundedRational {
  double value;
  bool exact;
};

enum class RationalError { none, not_a_number, zero_denominator, out_of_range };

// The double nearest to numerator / denominator, two decimal integers of any length up to 2000
// digits, and whether it is equal to it.
RationalError to_double(std::string_view numerator, std::string_view denominator,
                        RoundedRational& result);

}  // namespace lazyccd::io
