// Splits text files into lines, words and numbers.
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace lazyccd::io {

/// Reads a text line by line. Both "\n" and "\r\n" end a line.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : text_(text) {}

  /// Returns the next line, or nothing at the end of the text.
  std::optional<std::string_view> next() {
    if (at_ == text_.size()) return std::nullopt;
    const std::size_t end = text_.find('\n', at_);
    std::string_view line = text_.substr(at_, end - at_);
    at_ = end == std::string_view::npos ? text_.size() : end + 1;
    ++line_;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  std::size_t line() const { return line_; }  // number of the last line returned, from 1
  std::size_t byte() const { return at_; }    // where the next line starts

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;
};

/// Returns the words of a line, which blanks separate.
inline std::vector<std::string_view> words(std::string_view line) {
  constexpr std::string_view blanks = " \t\v\f\r";
  std::vector<std::string_view> result;
  for (std::size_t at = line.find_first_not_of(blanks); at != std::string_view::npos;) {
    const std::size_t end = line.find_first_of(blanks, at);
    result.push_back(line.substr(at, end - at));
    at = end == std::string_view::npos ? end : line.find_first_not_of(blanks, end);
  }
  return result;
}

/// Converts a whole word to a number. Returns nothing if that is not possible.
template <class Number>
std::optional<Number> to_number(std::string_view word) {
  if (!word.empty() && word[0] == '+') word.remove_prefix(1);
  Number value{};
#if !defined(__cpp_lib_to_chars)
  // libc++ before version 20 converts no floating-point numbers.
  if constexpr (std::is_floating_point_v<Number>) {
    const std::string copy(word);
    char* last = nullptr;
    value = std::is_same_v<Number, float> ? static_cast<Number>(std::strtof(copy.c_str(), &last))
                                          : static_cast<Number>(std::strtod(copy.c_str(), &last));
    const bool is_number = !copy.empty() && copy.find_first_of("xX") == std::string::npos;
    if (!is_number || last != copy.c_str() + copy.size()) return std::nullopt;
    const bool too_large =
        std::isinf(value) && copy.find_first_of("0123456789") != std::string::npos;
    if (too_large) return std::nullopt;
    return value;
  } else
#endif
  {
    const char* end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (error != std::errc() || stop != end) return std::nullopt;
    return value;
  }
}

}  // namespace lazyccd::io
