#include "io/rational.h"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>
#include <string>

namespace lazyccd::io {

namespace {

using boost::multiprecision::cpp_int;

bool is_integer(std::string_view text) {
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  return !text.empty() && text.size() <= 2000 &&
         std::all_of(text.begin(), text.end(), [](char c) { return '0' <= c && c <= '9'; });
}

// Removes leading zeros, because Boost reads a leading zero as an octal prefix.
cpp_int to_integer(std::string_view text) {
  const bool negative = text[0] == '-';
  text.remove_prefix(std::min(text.find_first_of("0123456789"), text.size()));
  text.remove_prefix(std::min(text.find_first_not_of('0'), text.size()));
  const cpp_int magnitude = text.empty() ? cpp_int(0) : cpp_int(std::string(text));
  return negative ? cpp_int(-magnitude) : magnitude;
}

int bit_length(const cpp_int& positive) {
  return static_cast<int>(boost::multiprecision::msb(positive)) + 1;
}

}  // namespace

RationalError to_double(std::string_view numerator, std::string_view denominator,
                        RoundedRational& result) {
  if (!is_integer(numerator) || !is_integer(denominator)) return RationalError::not_a_number;
  cpp_int n = to_integer(numerator), d = to_integer(denominator);
  if (d == 0) return RationalError::zero_denominator;
  const bool negative = (n < 0) != (d < 0);
  n = abs(n);
  d = abs(d);
  if (n == 0) {
    result = {0.0, true};
    return RationalError::none;
  }

  // The unit of the quotient is 2^exponent, the last bit of the double. It is rounded half to even.
  using Limits = std::numeric_limits<double>;
  int exponent = std::max(bit_length(n) - bit_length(d) - Limits::digits,
                          Limits::min_exponent - Limits::digits);
  if (exponent > 0) d <<= exponent;
  if (exponent < 0) n <<= -exponent;
  if (n >= (d << Limits::digits)) {
    d <<= 1;
    ++exponent;
  }
  cpp_int quotient, remainder;
  divide_qr(n, d, quotient, remainder);
  const int half = cpp_int(2 * remainder).compare(d);
  if (half > 0 || (half == 0 && bit_test(quotient, 0))) ++quotient;

  const double magnitude = std::ldexp(quotient.convert_to<double>(), exponent);
  if (!std::isfinite(magnitude)) return RationalError::out_of_range;
  result = {negative ? -magnitude : magnitude, remainder == 0};
  return RationalError::none;
}

}  // namespace lazyccd::io
